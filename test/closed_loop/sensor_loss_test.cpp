// Channels that are not measured for a while, in the closed loop: the robot stays on its way, and nothing jumps when
// they are lost or come back.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>
#include <tuple>

#include "monitored_loop.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kLoss = 3.0;    // s, from here ...
constexpr double kReturn = 6.0;  // ... to here
constexpr double kEnd = 8.0;

constexpr ChannelValidity kNoImu{false, true, true, false};
constexpr ChannelValidity kNoLeft{true, false, true, true};
constexpr ChannelValidity kNoRight{true, true, false, true};
constexpr ChannelValidity kNoWheels{true, false, false, true};

const PackageFiles& files() {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return files;
}

/// A run with one loss. @param changes of the set point.
std::vector<MonitoredSample> run(const char* controller, const ChannelValidity& remaining,
                                 const std::vector<SetPointProfile::Change>& changes, double until = kReturn) {
  SetPointProfile profile;
  profile.changes = changes;
  profile.duration = kEnd;
  Faults faults;
  faults.losses = {{remaining, kLoss, until}};
  return runMonitored(loadSetup(files(), controller, "ground", {}), monitorModel(files(), "ground"), profile, faults);
}

/// Largest deviations of the robot from its set point in a span of time.
struct Deviation {
  double velocity = 0.0;  // m/s
  double yaw_rate = 0.0;  // rad/s
};

Deviation deviation(const std::vector<MonitoredSample>& samples, double from, double until) {
  Deviation largest;
  int within = 0;
  for (const MonitoredSample& s : samples) {
    if (s.time < from || s.time > until) continue;
    ++within;
    largest.velocity = std::max(largest.velocity, std::abs(s.velocity - s.set_point.forward));
    largest.yaw_rate = std::max(largest.yaw_rate, std::abs(s.yaw_rate - s.set_point.yaw_rate));
  }
  EXPECT_GT(within, 0) << "no sample from " << from << " to " << until << " s";
  return largest;
}

/// Largest change of a wheel's command from one sample to the next [rad/s].
double largestStep(const std::vector<MonitoredSample>& samples, double from, double until) {
  double largest = 0.0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (samples[i].time < from || samples[i].time > until) continue;
    const WheelVector step = samples[i].command.vector() - samples[i - 1].command.vector();
    largest = std::max(largest, step.cwiseAbs().maxCoeff());
  }
  return largest;
}

struct Loss {
  const char* name;
  ChannelValidity remaining;
};
void PrintTo(const Loss& loss, std::ostream* out) { *out << loss.name; }

const Loss kLosses[] = {{"Imu", kNoImu}, {"LeftWheel", kNoLeft}, {"RightWheel", kNoRight}};

struct Motion {
  const char* name;
  SetPoint set_point;
};
void PrintTo(const Motion& motion, std::ostream* out) { *out << motion.name; }

const Motion kMotions[] = {{"Straight", {0.5, 0.0, 0.0}}, {"Turn", {0.0, 0.0, 0.5}}, {"Arc", {0.5, 0.0, 0.5}}};

/// Bounds of a structure.
struct Structure {
  const char* name;
  double velocity;  // largest deviation while a channel is lost [m/s]
  double
      yaw_rate;  // more than before the loss [rad/s]; the thesis' structures turn too fast or slowly without a loss too
  double step;   // largest step of a wheel's command at the loss and at the return [rad/s]
};
void PrintTo(const Structure& structure, std::ostream* out) { *out << structure.name; }

const Structure kStructures[] = {
    {"predictive", 0.02, 0.03, 0.6}, {"improved", 0.03, 0.05, 0.6}, {"standard", 0.03, 0.05, 0.6}};

class OneLoss : public testing::TestWithParam<std::tuple<Structure, Motion, Loss>> {};

TEST_P(OneLoss, RobotGoesOnAndNothingJumps) {
  const auto& [structure, motion, loss] = GetParam();
  const auto samples = run(structure.name, loss.remaining, {{kRestTime, motion.set_point}});
  const Deviation before = deviation(samples, kLoss - 0.5, kLoss);
  const Deviation after = deviation(samples, kLoss, kEnd);
  EXPECT_LE(after.velocity, before.velocity + structure.velocity);
  EXPECT_LE(after.yaw_rate, before.yaw_rate + structure.yaw_rate);
  EXPECT_LE(largestStep(samples, kLoss, kLoss + 0.5), structure.step);
  EXPECT_LE(largestStep(samples, kReturn, kReturn + 0.5), structure.step);
  for (const MonitoredSample& s : samples) EXPECT_FALSE(s.report.faulty()) << "a lost channel is no faulty one";
}

INSTANTIATE_TEST_SUITE_P(Steady, OneLoss,
                         testing::Combine(testing::ValuesIn(kStructures), testing::ValuesIn(kMotions),
                                          testing::ValuesIn(kLosses)),
                         [](const auto& info) {
                           return std::string(std::get<0>(info.param).name) + std::get<1>(info.param).name +
                                  std::get<2>(info.param).name;
                         });

class StepUnderLoss : public testing::TestWithParam<std::tuple<const char*, Loss>> {};

TEST_P(StepUnderLoss, NewSetPointIsReached) {
  const auto& [controller, loss] = GetParam();
  const auto samples = run(controller, loss.remaining, {{kRestTime, {0.5, 0.0, 0.0}}, {kLoss + 0.2, {0.2, 0.0, 0.3}}});
  const Deviation settled = deviation(samples, kReturn - 1.0, kReturn);
  EXPECT_LE(settled.velocity, 0.02);
  EXPECT_LE(settled.yaw_rate, 0.05);
}

INSTANTIATE_TEST_SUITE_P(BothStructures, StepUnderLoss,
                         testing::Combine(testing::Values("predictive", "improved"), testing::ValuesIn(kLosses)),
                         [](const auto& info) {
                           return std::string(std::get<0>(info.param)) + std::get<1>(info.param).name;
                         });

TEST(BothWheelsLost, PredictiveDrivesOnTheModel) {
  const auto samples =
      run("predictive", kNoWheels, {{kRestTime, {0.5, 0.0, 0.0}}, {kLoss + 0.2, {0.3, 0.0, 0.2}}}, kLoss + 1.5);
  const Deviation settled = deviation(samples, kLoss + 1.0, kLoss + 1.5);
  EXPECT_LE(settled.velocity, 0.03);
  EXPECT_LE(settled.yaw_rate, 0.05);
  EXPECT_LE(largestStep(samples, kLoss + 1.5, kLoss + 2.0), 0.6) << "the wheels come back without a jump";
}

TEST(BothWheelsLost, ThesisStructureTakesNoSample) {
  const LoopSetup setup = loadSetup(files(), "improved", "ground", {});
  ActiveInferenceController controller(std::get<ControllerParameters>(setup.drive.controller), setup.drive.geometry);
  Observation y;
  y.wheel_left = y.wheel_right = 5.0;
  ASSERT_TRUE(taken(controller.observe(y)));
  Observation blind = y;
  blind.stamp = 0.02;
  blind.wheel_left = blind.wheel_right = 0.0;
  blind.valid = kNoWheels;
  EXPECT_EQ(controller.observe(blind), SampleVerdict::incomplete);
  EXPECT_EQ(controller.measurement().col(0), y.vector());
}

TEST(NumbersOfLostChannels, DoNotReachThePredictiveController) {
  Observation y;
  LoopSetup setup = loadSetup(files(), "predictive", "ground", {});
  PredictiveController clean(std::get<PredictiveParameters>(setup.drive.controller), setup.drive.geometry,
                             *setup.drive.plant_model);
  PredictiveController poisoned = clean;
  clean.setSetPoint({0.5, 0.0, 0.2});
  poisoned.setSetPoint({0.5, 0.0, 0.2});
  for (int k = 0; k < 2000; ++k) {
    if (k % 20 == 0) {
      y.stamp = 0.001 * k;
      y.valid = k % 3 == 0 ? kNoImu : kNoLeft;
      clean.observe(y);
      Observation nonsense = y;
      const double nan = std::numeric_limits<double>::quiet_NaN();
      if (!y.valid.yaw_rate) nonsense.yaw_rate = nonsense.acceleration_x = nonsense.acceleration_y = nan;
      if (!y.valid.wheel_left) nonsense.wheel_left = nan;
      EXPECT_TRUE(taken(poisoned.observe(nonsense)));
    }
    clean.updateBelief();
    poisoned.updateBelief();
    if (k % 20 != 19) continue;
    EXPECT_EQ(clean.updateAction(), poisoned.updateAction());
  }
  EXPECT_TRUE(poisoned.believedVelocity().allFinite());
}

}  // namespace
}  // namespace jackal_aic::sim
