// Channels that are not measured for a while, in the closed loop: the robot stays on its way, and no command jumps.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "drives.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kLoss = 3.0;    // s, from here ...
constexpr double kReturn = 6.0;  // ... to here
constexpr double kEnd = 8.0;

constexpr ChannelValidity kNoImu{false, true, true, false};
constexpr ChannelValidity kNoLeft{true, false, true, true};
constexpr ChannelValidity kNoRight{true, true, false, true};
constexpr ChannelValidity kNoWheels{true, false, false, true};

const struct {
  const char* name;
  ChannelValidity remaining;
} kLosses[] = {{"IMU", kNoImu}, {"left wheels", kNoLeft}, {"right wheels", kNoRight}};

/// A run with one loss. @param changes of the set point.
std::vector<MonitoredSample> run(const char* controller, const ChannelValidity& remaining,
                                 const std::vector<SetPointProfile::Change>& changes, double until = kReturn) {
  SetPointProfile profile;
  profile.changes = changes;
  profile.duration = kEnd;
  Faults faults;
  const auto lose = [&](bool remains, FaultChannel channel) {
    if (!remains) faults.push_back({FaultKind::lost, channel, 0.0, kLoss, until - kLoss});
  };
  lose(remaining.yaw_rate, FaultChannel::gyro);
  lose(remaining.wheel_left, FaultChannel::left);
  lose(remaining.wheel_right, FaultChannel::right);
  lose(remaining.acceleration, FaultChannel::acceleration);
  return runMonitored(loadSetup(files(), controller, "ground", {}), monitorModel(files(), "ground"), profile, faults);
}

/// Largest deviations of the robot from its set point, and step of a wheel's command, in a span of time.
struct Deviation {
  double velocity = 0.0;  // m/s
  double yaw_rate = 0.0;  // rad/s
  double step = 0.0;      // rad/s
};

Deviation deviation(const std::vector<MonitoredSample>& samples, double from, double until) {
  Deviation largest;
  int within = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const MonitoredSample& s = samples[i];
    if (s.time < from || s.time > until) continue;
    ++within;
    largest.velocity = std::max(largest.velocity, std::abs(s.velocity - s.set_point.forward));
    largest.yaw_rate = std::max(largest.yaw_rate, std::abs(s.yaw_rate - s.set_point.yaw_rate));
    const WheelVector step = s.command.vector() - samples[i - 1].command.vector();
    largest.step = std::max(largest.step, step.cwiseAbs().maxCoeff());
  }
  EXPECT_GT(within, 0) << "no sample from " << from << " to " << until << " s";
  return largest;
}

TEST(OneLoss, RobotDrivesOnAndNoCommandJumps) {
  const struct {
    const char* controller;
    double velocity;  // largest deviation while a channel is lost, more than before [m/s]
    double yaw_rate;  // the same of the yaw rate [rad/s]
  } structures[] = {{"predictive", 0.02, 0.03}, {"improved", 0.03, 0.05}, {"standard", 0.03, 0.05}};
  constexpr double kStep = 0.6;  // rad/s, of a wheel's command at the loss and at the return
  for (const auto& structure : structures) {
    for (const SetPoint& set_point : {SetPoint{0.5, 0.0, 0.0}, SetPoint{0.0, 0.0, 0.5}, SetPoint{0.5, 0.0, 0.5}}) {
      for (const auto& loss : kLosses) {
        SCOPED_TRACE(testing::Message() << structure.controller << " without " << loss.name << ", " << set_point.forward
                                        << " m/s, " << set_point.yaw_rate << " rad/s");
        const auto samples = run(structure.controller, loss.remaining, {{kRestTime, set_point}});
        const Deviation before = deviation(samples, kLoss - 0.5, kLoss), after = deviation(samples, kLoss, kEnd);
        EXPECT_LE(after.velocity, before.velocity + structure.velocity);
        EXPECT_LE(after.yaw_rate, before.yaw_rate + structure.yaw_rate);
        EXPECT_LE(deviation(samples, kLoss, kLoss + 0.5).step, kStep);
        EXPECT_LE(deviation(samples, kReturn, kReturn + 0.5).step, kStep);
        for (const MonitoredSample& s : samples) EXPECT_FALSE(s.report.faulty()) << "a lost channel is not faulty";
      }
    }
  }
}

TEST(BothWheelsLost, PredictiveDrivesOnItsModel) {
  const auto samples =
      run("predictive", kNoWheels, {{kRestTime, {0.5, 0.0, 0.0}}, {kLoss + 0.2, {0.3, 0.0, 0.2}}}, kLoss + 1.5);
  const Deviation settled = deviation(samples, kLoss + 1.0, kLoss + 1.5);
  EXPECT_LE(settled.velocity, 0.03);
  EXPECT_LE(settled.yaw_rate, 0.05);
  EXPECT_LE(deviation(samples, kLoss + 1.5, kLoss + 2.0).step, 0.6) << "the wheels come back without a jump";
}

TEST(LostChannels, TheirNumbersDoNotReachThePredictiveController) {
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
    if (k % 20 == 19) {
      EXPECT_EQ(clean.updateAction(), poisoned.updateAction());
    }
  }
  EXPECT_TRUE(poisoned.believedVelocity().allFinite());
}

}  // namespace
}  // namespace jackal_aic::sim
