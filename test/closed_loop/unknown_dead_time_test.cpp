// The predictive controller on robots whose dead time it was told wrong: it learns while it drives.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <utility>

#include "drives.hpp"
#include "loop_setup.hpp"
#include "step_response.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kOff = 0.08;      // s, by which the dead time is told wrong
constexpr double kDriving = 10.0;  // s of ordinary driving
constexpr double kPause = 3.0;     // s
constexpr double kStep = 4.0;      // s

const PackageFiles& files() {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return files;
}

/// Ten seconds at a joystick, a pause, and a step.
AssessedProfile drivingThenStep(std::uint64_t seed, const SetPoint& step) {
  AssessedProfile profile{joystickDriving(seed, kRestTime + kDriving)};
  const double stop = kRestTime + kDriving, begin = stop + kPause;
  profile.changes.push_back({stop, {}});
  profile.changes.push_back({begin, step});
  profile.duration = profile.assessed_until = begin + kStep;
  profile.assessed_from = begin;
  profile.assessed = step.forward != 0.0 ? kForward : kYaw;
  return profile;
}

AssessedProfile steadily(const SetPoint& set_point, double duration) {
  AssessedProfile profile;
  profile.assessed.reset();
  profile.changes = {{kRestTime, set_point}};
  profile.duration = duration;
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
  return {dynamic_cast<const PredictiveController&>(loop.controller()).model(), assess(samples, profile)};
}

/// A robot whose dead time is told wrong. @param off by so much [s].
Overrides told(const std::string& plant, double off, Overrides robot) {
  const double dead_time = loadSetup(files(), "predictive", plant, {}).drive.plant_model->dead_time;
  robot.emplace_back("plant_model.dead_time", std::to_string(std::max(0.0, dead_time + off)));
  return robot;
}

Overrides withoutLearning(Overrides robot) {
  robot.emplace_back("predictive.learn_drive_train", "false");
  return robot;
}

/// Told wrong either way it finds the dead time within 10 ms, and settles within 1.25 times the time of a controller
/// that knows it.
void expectLearned(const std::string& plant, const Overrides& robot, const SetPoint& step, double delay = 0.0,
                   double tolerance = 0.01) {
  const double truth = loadSetup(files(), "predictive", plant, robot).plant.dead_time + delay;
  for (const double off : {-kOff, kOff}) {
    for (const std::uint64_t seed : {1, 2}) {
      SCOPED_TRACE(plant + ", off " + std::to_string(off) + ", seed " + std::to_string(seed));
      const AssessedProfile profile = drivingThenStep(seed, step);
      const Drive known = drive(plant, withoutLearning(robot), profile),
                  learned = drive(plant, told(plant, off, robot), profile);
      std::printf(
          "%s, %g m/s, %g rad/s, told %+g s, seed %d: dead time %.4f s of %.4f, lag %.4f; settles in %.3f of %.3f s\n",
          plant.c_str(), step.forward, step.yaw_rate, off, static_cast<int>(seed), learned.believed.dead_time, truth,
          learned.believed.lag, learned.step.settling.value_or(-1.0), known.step.settling.value_or(-1.0));
      EXPECT_NEAR(learned.believed.dead_time, truth, tolerance);
      ASSERT_TRUE(learned.step.settling && known.step.settling);
      EXPECT_LE(*learned.step.settling, 1.25 * *known.step.settling);
      EXPECT_LE(learned.step.overshoot_pct, std::max(5.0, known.step.overshoot_pct + 2.0));
    }
  }
}

/// The gain is learned as the dead time is: told a fifth less or a quarter more than it is.
TEST(UnknownGain, IsLearnedInTenSeconds) {
  for (const char* plant : {"ground", "box"}) {
    const double truth = loadSetup(files(), "predictive", plant, {}).drive.plant_model->gain;
    for (const double told_share : {0.8, 1.25}) {
      for (const SetPoint& step : {SetPoint{0.5, 0.0, 0.0}, SetPoint{1.5, 0.0, 0.0}, SetPoint{0.0, 0.0, 0.8}}) {
        SCOPED_TRACE(std::string(plant) + ", told " + std::to_string(told_share));
        const Overrides wrong{{"plant_model.gain", std::to_string(told_share * truth)}};
        const AssessedProfile profile = drivingThenStep(1, step);
        const Drive known = drive(plant, withoutLearning({}), profile), learned = drive(plant, wrong, profile);
        EXPECT_NEAR(learned.believed.gain, truth, 0.03 * truth);
        ASSERT_TRUE(learned.step.settling && known.step.settling);
        EXPECT_LE(*learned.step.settling, 1.25 * *known.step.settling + 0.05);
        EXPECT_LE(learned.step.overshoot_pct, 10.0);
      }
    }
  }
}

TEST(UnknownDeadTime, IsLearnedInTenSeconds) {
  expectLearned("ground", {}, {0.5, 0.0, 0.0});
  expectLearned("box", {}, {0.5, 0.0, 0.0});
}

TEST(UnknownDeadTime, IsLearnedForSlowAndFastStepsAndTurns) {
  expectLearned("ground", {}, {0.1, 0.0, 0.0});
  expectLearned("ground", {}, {1.5, 0.0, 0.0});
  expectLearned("ground", {}, {0.0, 0.0, 0.5});
}

TEST(UnknownDeadTime, IsLearnedWithCoarseAndLateSensors) {
  expectLearned("ground", {{"plant.encoder_step", "0.1"}, {"plant.stamp_jitter", "0.008"}}, {0.5, 0.0, 0.0}, 0.004);
}

TEST(UnknownDeadTime, IsLearnedOnRobotsWithOtherMotors) {
  expectLearned("ground", {{"plant.acceleration_limit", "4"}}, {0.5, 0.0, 0.0});
  expectLearned("ground", {{"plant.acceleration_limit", "0.825"}}, {0.5, 0.0, 0.0});
  expectLearned("box", {{"plant.acceleration_limit", "12.5"}}, {0.5, 0.0, 0.0});
  expectLearned("ground", {{"plant.wheel_gain", "0.8"}}, {0.5, 0.0, 0.0});
  // A soft loop is none of the model's: it lags at first and then runs ahead.
  expectLearned("ground", {{"plant.velocity_loop_stiffness", "3.5"}, {"plant.velocity_loop_integral", "8"}},
                {0.5, 0.0, 0.0}, 0.0, 0.02);
}

TEST(UnknownDeadTime, IsToldFromALagThatIsFarOff) {
  for (const char* plant : {"ground", "box"}) {
    for (const double off : {-kOff, kOff}) {
      for (const std::uint64_t seed : {1, 2}) {
        SCOPED_TRACE(std::string(plant) + ", off " + std::to_string(off) + ", seed " + std::to_string(seed));
        const Overrides robot{{"plant.motor_lag", "0.06"}};
        const AssessedProfile profile = drivingThenStep(seed, {0.5, 0.0, 0.0});
        Overrides right = withoutLearning(robot);
        right.emplace_back("plant_model.lag", "0.06");
        const Drive known = drive(plant, right, profile), learned = drive(plant, told(plant, off, robot), profile);
        std::printf("%s, told %+g s, seed %d: dead time %.4f s, lag %.4f; settles in %.3f of %.3f s\n", plant, off,
                    static_cast<int>(seed), learned.believed.dead_time, learned.believed.lag,
                    learned.step.settling.value_or(-1.0), known.step.settling.value_or(-1.0));
        EXPECT_NEAR(learned.believed.dead_time, loadSetup(files(), "predictive", plant, {}).plant.dead_time, 0.01);
        EXPECT_NEAR(learned.believed.lag, 0.06, 0.01);
        ASSERT_TRUE(learned.step.settling && known.step.settling);
        EXPECT_LE(*learned.step.settling, 1.25 * *known.step.settling);
      }
    }
  }
}

TEST(UnknownDeadTime, IsLearnedFromStraightRampsTurnsAndArcs) {
  // Nothing but ramps at the acceleration limit, which the commands begin with less than a whole period's step.
  for (const SetPoint& motion :
       {SetPoint{1.0, 0.0, 0.0}, {1.5, 0.0, 0.0}, {0.1, 0.0, 0.0}, {0.0, 0.0, 1.0}, {0.5, 0.0, 0.5}}) {
    for (const double off : {-kOff, kOff}) {
      AssessedProfile profile;
      profile.assessed.reset();
      for (int i = 0; i < 6; ++i) profile.changes.push_back({kRestTime + 2.0 * i, i % 2 == 0 ? motion : SetPoint{}});
      profile.duration = kRestTime + 12.0;
      const Drive learned = drive("ground", told("ground", off, {}), profile);
      std::printf("%g m/s, %g rad/s, told %+g s: dead time %.4f s, lag %.4f s\n", motion.forward, motion.yaw_rate, off,
                  learned.believed.dead_time, learned.believed.lag);
      EXPECT_NEAR(learned.believed.dead_time, 0.08, 0.01) << motion.forward << ", " << motion.yaw_rate << ", " << off;
      EXPECT_NEAR(learned.believed.lag, 0.00636, 0.01);
    }
  }
}

TEST(UnknownDeadTime, IsLearnedOfWhatTheRealRobotIsLate) {
  // 0.08 s of the motors, 10 ms of the network to them, 10 ms for which the newest feedback waits for its joint states,
  // 2.5 ms of their stamps, 10 ms of the network from them; a lag of 6 ms of the motors and 20 ms of the encoders.
  for (const double off : {-kOff, 0.0, kOff}) {
    for (const std::uint64_t seed : {1, 2}) {
      AssessedProfile profile{joystickDriving(seed, kRestTime + kDriving)};
      profile.changes.push_back({kRestTime + kDriving, {}});
      profile.duration = kRestTime + kDriving + kPause;
      profile.assessed.reset();
      const Drive learned = drive("real", told("real", off, {}), profile);
      std::printf("real, told %+g s, seed %d: dead time %.4f s, lag %.4f s\n", off, static_cast<int>(seed),
                  learned.believed.dead_time, learned.believed.lag);
      EXPECT_NEAR(learned.believed.dead_time + learned.believed.lag, 0.1389, 0.015) << off;
    }
  }
}

TEST(UnknownDeadTime, DoesNotDriftWithoutExcitation) {
  const std::pair<const char*, SetPoint> drives[] = {{"box", {0.3, 0.0, 0.5}}, {"real", {0.5, 0.0, 0.0}}};
  for (const auto& [plant, set_point] : drives) {
    const double told = loadSetup(files(), "predictive", plant, {}).drive.plant_model->dead_time;
    EXPECT_NEAR(drive(plant, {}, steadily(set_point, 1800.0)).believed.dead_time, told, 0.001) << plant;
  }
}

TEST(UnknownDeadTime, StaysAsToldByRequest) {
  const AssessedProfile profile = drivingThenStep(1, {0.5, 0.0, 0.0});
  const Drive unlearned = drive("ground", withoutLearning(told("ground", kOff, {})), profile);
  EXPECT_NEAR(unlearned.believed.dead_time, 0.16, 1e-9);
}

}  // namespace
}  // namespace jackal_aic::sim
