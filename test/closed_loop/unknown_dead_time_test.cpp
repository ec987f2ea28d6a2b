// The predictive controller on robots whose dead time or gain is configured wrong: it learns them while it drives.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>

#include "drives.hpp"
#include "loop_setup.hpp"
#include "step_response.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kOff = 0.08;      // s, by which the configured dead time is wrong
constexpr double kDriving = 10.0;  // s of ordinary driving
constexpr double kPause = 3.0;     // s
constexpr double kStep = 4.0;      // s

const SetPoint kHalf{0.5, 0.0, 0.0};

/// Ten seconds at a joystick, a pause, and a step that is assessed; without one the drive ends with the pause.
AssessedProfile drivingThenStep(std::uint64_t seed, const SetPoint& step) {
  AssessedProfile profile{joystickDriving(seed, kRestTime + kDriving)};
  const double stop = kRestTime + kDriving, begin = stop + kPause;
  profile.changes.push_back({stop, {}});
  profile.duration = begin;
  profile.assessed.reset();
  if (step.vector().isZero(0.0)) return profile;
  profile.changes.push_back({begin, step});
  profile.duration = profile.assessed_until = begin + kStep;
  profile.assessed_from = begin;
  profile.assessed = step.forward != 0.0 ? kForward : kYaw;
  return profile;
}

struct Drive {
  PlantModel believed;
  ResponseMetrics step;
};

Drive drive(const std::string& plant_name, const Overrides& overrides, const AssessedProfile& profile) {
  const LoopSetup setup = loadSetup(files(), "predictive", plant_name, overrides);
  JackalPlant plant(setup.urdf, setup.plant);
  DriveLoop loop = makeLoop(setup);
  const auto samples = runClosedLoop(plant, loop, profile, setup.plant.support, setup.drive.geometry, setup.loop);
  return {dynamic_cast<const PredictiveController&>(loop.controller()).model(),
          profile.assessed ? assess(samples, profile) : ResponseMetrics{}};
}

Overrides with(Overrides robot, const std::string& key, const std::string& value) {
  robot.emplace_back(key, value);
  return robot;
}

/// A controller whose dead time is configured wrong by so much [s].
Overrides wrong(const std::string& plant, double off, const Overrides& robot = {}) {
  const double dead_time = loadSetup(files(), "predictive", plant, {}).drive.plant_model->dead_time;
  return with(robot, "plant_model.dead_time", std::to_string(std::max(0.0, dead_time + off)));
}

Overrides withoutLearning(const Overrides& robot) { return with(robot, "predictive.learn_drive_train", "false"); }

/// Settles within 1.25 times the time of a controller that knows the robot.
void expectAsFast(const Drive& learned, const Drive& known, double slack = 0.0) {
  ASSERT_TRUE(learned.step.settling && known.step.settling);
  EXPECT_LE(*learned.step.settling, 1.25 * *known.step.settling + slack);
}

TEST(UnknownDeadTime, IsLearnedInTenSeconds) {
  const struct {
    const char* plant;
    SetPoint step;
    Overrides robot;
    double delay = 0.0;       // of late sensors [s]
    double tolerance = 0.01;  // s
  } rows[] = {
      {"ground", kHalf, {}},
      {"box", kHalf, {}},
      {"ground", {0.1, 0.0, 0.0}, {}},
      {"ground", {1.5, 0.0, 0.0}, {}},
      {"ground", {0.0, 0.0, 0.5}, {}},
      {"ground", kHalf, {{"plant.encoder_step", "0.1"}, {"plant.stamp_jitter", "0.008"}}, 0.004},
      {"ground", kHalf, {{"plant.acceleration_limit", "4"}}},
      {"ground", kHalf, {{"plant.acceleration_limit", "0.825"}}},
      {"box", kHalf, {{"plant.acceleration_limit", "12.5"}}},
      {"ground", kHalf, {{"plant.wheel_gain", "0.8"}}},
      // A soft loop is not the model's: it lags at first and then runs ahead.
      {"ground", kHalf, {{"plant.velocity_loop_stiffness", "3.5"}, {"plant.velocity_loop_integral", "8"}}, 0.0, 0.02}};
  for (const auto& row : rows) {
    const double truth = loadSetup(files(), "predictive", row.plant, row.robot).plant.dead_time + row.delay;
    for (const std::uint64_t seed : {1, 2}) {
      const AssessedProfile profile = drivingThenStep(seed, row.step);
      const Drive known = drive(row.plant, withoutLearning(row.robot), profile);
      for (const double off : {-kOff, kOff}) {
        SCOPED_TRACE(testing::Message() << row.plant << ", row " << &row - rows << ", off " << off << ", seed "
                                        << seed);
        const Drive learned = drive(row.plant, wrong(row.plant, off, row.robot), profile);
        EXPECT_NEAR(learned.believed.dead_time, truth, row.tolerance);
        expectAsFast(learned, known);
        EXPECT_LE(learned.step.overshoot_pct, std::max(5.0, known.step.overshoot_pct + 2.0));
      }
    }
  }
}

TEST(UnknownGain, IsLearnedInTenSeconds) {
  for (const char* plant : {"ground", "box"}) {
    const double truth = loadSetup(files(), "predictive", plant, {}).drive.plant_model->gain;
    for (const SetPoint& step : {kHalf, SetPoint{1.5, 0.0, 0.0}, SetPoint{0.0, 0.0, 0.8}}) {
      const AssessedProfile profile = drivingThenStep(1, step);
      const Drive known = drive(plant, withoutLearning({}), profile);
      for (const double share : {0.8, 1.25}) {
        SCOPED_TRACE(std::string(plant) + ", configured " + std::to_string(share));
        const Drive learned = drive(plant, {{"plant_model.gain", std::to_string(share * truth)}}, profile);
        EXPECT_NEAR(learned.believed.gain, truth, 0.03 * truth);
        expectAsFast(learned, known, 0.05);
        EXPECT_LE(learned.step.overshoot_pct, 10.0);
      }
    }
  }
}

TEST(UnknownDeadTime, IsSeparatedFromALagThatIsFarOff) {
  const Overrides robot{{"plant.motor_lag", "0.06"}};
  for (const char* plant : {"ground", "box"}) {
    for (const std::uint64_t seed : {1, 2}) {
      const AssessedProfile profile = drivingThenStep(seed, kHalf);
      const Drive known = drive(plant, with(withoutLearning(robot), "plant_model.lag", "0.06"), profile);
      for (const double off : {-kOff, kOff}) {
        SCOPED_TRACE(testing::Message() << plant << ", off " << off << ", seed " << seed);
        const Drive learned = drive(plant, wrong(plant, off, robot), profile);
        EXPECT_NEAR(learned.believed.dead_time, loadSetup(files(), "predictive", plant, {}).plant.dead_time, 0.01);
        EXPECT_NEAR(learned.believed.lag, 0.06, 0.01);
        expectAsFast(learned, known);
      }
    }
  }
}

TEST(UnknownDeadTime, IncludesAllDelaysOfTheRealRobot) {
  // 0.08 s of the motors, 10 ms of the network to them, 10 ms for which the newest feedback waits for its joint states,
  // 2.5 ms of their stamps, 10 ms of the network from them; a lag of 6 ms of the motors and 20 ms of the encoders.
  for (const double off : {-kOff, 0.0, kOff}) {
    for (const std::uint64_t seed : {1, 2}) {
      const Drive learned = drive("real", wrong("real", off), drivingThenStep(seed, {}));
      EXPECT_NEAR(learned.believed.dead_time + learned.believed.lag, 0.1389, 0.015) << off;
    }
  }
}

TEST(UnknownDeadTime, DoesNotDriftWithoutExcitationNorLearnWhenDisabled) {
  const std::pair<const char*, SetPoint> drives[] = {{"box", {0.3, 0.0, 0.5}}, {"real", {0.5, 0.0, 0.0}}};
  for (const auto& [plant, set_point] : drives) {
    AssessedProfile steady;
    steady.assessed.reset();
    steady.changes = {{kRestTime, set_point}};
    steady.duration = 1800.0;
    const double configured = loadSetup(files(), "predictive", plant, {}).drive.plant_model->dead_time;
    EXPECT_NEAR(drive(plant, {}, steady).believed.dead_time, configured, 0.001) << plant;
  }
  const Drive disabled = drive("ground", withoutLearning(wrong("ground", kOff)), drivingThenStep(1, {}));
  EXPECT_NEAR(disabled.believed.dead_time, 0.16, 1e-9);
}

}  // namespace
}  // namespace jackal_aic::sim
