#include "jackal_aic/predictive/drive_train_learning.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "jackal_aic/model/wheel_belief.hpp"

namespace jackal_aic {
namespace {

constexpr double kRadius = 0.098;     // m
constexpr double kVariance = 9e-4;    // (rad/s)^2, of a measured wheel speed
constexpr double kSamplePeriod = 20;  // steps

PlantModel modelWith(double dead_time, double lag) {
  PlantModel model;
  model.dead_time = dead_time;
  model.lag = lag;
  model.velocity_loop_integral = 0.7;
  return model;
}

/// Both wheels of a robot with a drive train, and a DriveTrainLearning that starts from another one.
class LearningFromARobot {
 public:
  LearningFromARobot(const PlantModel& robot, const PlantModel& configured, double noise = 0.03, unsigned seed = 1)
      : robot_(robot, kRadius, {}), learning_(configured, kRadius, kVariance), generator_(seed), noise_(0.0, noise) {
    robot_.reset(0.0);
  }

  /// Goes to a command [rad/s] in steps of an action period, as far in each as an acceleration [rad/s^2] takes it, and
  /// stays there until a time [s] is over. Returns how often the timing was changed. @param jitter of the commands,
  /// whose controller follows the noise, in that of the wheels.
  int ramp(double from, double to, double acceleration, double seconds, double jitter = 0.0) {
    constexpr double kPeriod = 0.02;  // s
    int changes = 0;
    for (double time = 0.0; time < seconds; time += kPeriod) {
      const double way = std::min(acceleration * (time + 0.5 * kPeriod), std::abs(to - from));
      changes += drive(from + std::copysign(way, to - from) + jitter * noise_(generator_), kPeriod);
    }
    return changes;
  }

  /// Gives a command to both wheels [rad/s] for a time [s]. Returns how often the timing was changed.
  int drive(double command, double seconds) {
    int changes = 0;
    for (long k = 0; k < std::lround(1000.0 * seconds); ++k) {
      learning_.predict({command, command});
      robot_.predict(command);
      if (++steps_ % std::lround(kSamplePeriod) != 0) continue;
      const double y = robot_.speed() + noise_(generator_);
      if (learning_.correct({y, y + noise_(generator_)}, 0.001 * kSamplePeriod)) ++changes;
    }
    return changes;
  }

  /// Steps of two seconds, in both directions.
  void driveSteps(int steps) {
    for (int i = 0; i < steps; ++i) drive(i % 3 == 0 ? 5.0 : i % 3 == 1 ? 2.0 : -4.0, 2.0);
  }

  /// Ramps to 10 rad/s and back at the acceleration limit, three times.
  void rampUpAndDown() {
    const double limit = PlantModel{}.acceleration_limit / kRadius;
    for (int i = 0; i < 6; ++i) ramp(i % 2 == 0 ? 0.0 : 10.0, i % 2 == 0 ? 10.0 : 0.0, limit, 2.0);
  }

  DriveTrainLearning& learning() { return learning_; }

 private:
  WheelBelief robot_;
  DriveTrainLearning learning_;
  std::mt19937 generator_;
  std::normal_distribution<double> noise_;
  long steps_ = 0;
};

TEST(DriveTrainLearning, FindsADeadTimeFarOff) {
  for (const double truth : {0.03, 0.08, 0.16, 0.3}) {
    for (const double configured : {0.0, 0.08, 0.24}) {
      LearningFromARobot robot(modelWith(truth, 0.03), modelWith(configured, 0.03));
      for (const double command : {5.0, 0.0, 3.0, -5.0, 0.0}) robot.drive(command, 2.0);
      EXPECT_NEAR(robot.learning().timing().dead_time, truth, 0.0065) << "configured " << configured;
      EXPECT_NEAR(robot.learning().timing().lag, 0.03, 0.01) << truth << ", configured " << configured;
    }
  }
}

TEST(DriveTrainLearning, SeparatesTheLagFromTheDeadTime) {
  // Beyond the limit a lag delays a ramp as a dead time does; it shows where a motion begins and ends.
  struct Lags {
    double truth, configured, tolerance;
  };
  // A lag that was configured holds a shorter one back, which hardly differs from it.
  for (const Lags& lag : {Lags{0.12, 0.03, 0.01}, {0.06, 0.006, 0.01}, {0.006, 0.06, 0.014}}) {
    LearningFromARobot robot(modelWith(0.08, lag.truth), modelWith(0.08, lag.configured));
    for (int i = 0; i < 10; ++i) robot.drive(i % 2 == 0 ? 5.0 : -2.0, 2.0);
    EXPECT_NEAR(robot.learning().timing().dead_time, 0.08, 0.005) << lag.configured;
    EXPECT_NEAR(robot.learning().timing().lag, lag.truth, lag.tolerance) << lag.configured;
  }
}

TEST(DriveTrainLearning, GainOffsetAndLimitOfTheMotorsAreNoDeadTime) {
  void (*const changes[])(PlantModel&) = {
      [](PlantModel& m) { m.gain = 0.8; }, [](PlantModel& m) { m.gain = 1.2; }, [](PlantModel& m) { m.offset = 0.5; },
      [](PlantModel& m) { m.acceleration_limit *= 0.6; }, [](PlantModel& m) { m.acceleration_limit *= 3.0; }};
  for (std::size_t i = 0; i < std::size(changes); ++i) {
    PlantModel motors = modelWith(0.08, 0.03);
    changes[i](motors);
    LearningFromARobot robot(motors, modelWith(0.08, 0.03));
    robot.driveSteps(12);
    EXPECT_NEAR(robot.learning().timing().dead_time, 0.08, 0.01) << i;
  }
  // At the limit a wheel that turns slower by o is late by o over the limit, 30 ms, at the start alone.
  PlantModel offset = modelWith(0.08, 0.006);
  offset.offset = 0.5;
  LearningFromARobot ramps(offset, modelWith(0.08, 0.006));
  ramps.rampUpAndDown();
  EXPECT_NEAR(ramps.learning().timing().dead_time, 0.08, 0.01);
  for (const double configured : {0.0, 0.08, 0.16}) {  // a limit far below the model's
    PlantModel slow = modelWith(0.08, 0.006);
    slow.acceleration_limit *= 0.5;
    LearningFromARobot robot(slow, modelWith(configured, 0.006));
    for (const double command : {10.0, 0.0, 6.0}) robot.drive(command, 2.5);
    EXPECT_NEAR(robot.learning().timing().dead_time, 0.08, 0.01) << configured;
  }
}

TEST(DriveTrainLearning, KeepsATimingThatIsRight) {
  for (const double noise : {0.0, 0.03, 0.1}) {
    LearningFromARobot robot(modelWith(0.08, 0.03), modelWith(0.08, 0.03), noise);
    int changes = 0;
    for (int i = 0; i < 50; ++i) changes += robot.drive(i % 3 == 0 ? 5.0 : i % 3 == 1 ? 1.0 : -3.0, 1.7);
    EXPECT_EQ(changes, 0) << noise;
  }
}

TEST(DriveTrainLearning, GainIsLearnedAndWithdrawn) {
  for (const double gain : {0.8, 1.25}) {
    PlantModel robot = modelWith(0.08, 0.03);
    robot.gain = gain;
    LearningFromARobot driven(robot, modelWith(0.08, 0.03));
    driven.driveSteps(12);
    EXPECT_NEAR(driven.learning().timing().gain_share, gain, 0.03);
    EXPECT_TRUE(driven.learning().withdrawGain());
    EXPECT_EQ(driven.learning().timing().gain_share, 1.0);
    EXPECT_FALSE(driven.learning().withdrawGain()) << "nothing is left to withdraw";
  }
}

TEST(DriveTrainLearning, MotionThatSettlesUnmeasuredIsNotLearned) {
  // A process that was held up: the robot brakes, its motion is forgotten, and it accelerates again while its wheels
  // still slow down. Once its motion is known again it drives steadily.
  const double limit = PlantModel{}.acceleration_limit / kRadius;
  for (unsigned seed = 1; seed <= 120; ++seed) {
    LearningFromARobot robot(modelWith(0.08, 0.006), modelWith(0.08, 0.006), 0.03, seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    robot.drive(0.0, 0.4);
    robot.ramp(0.0, 10.2, limit, 1.6, 0.7);
    for (unsigned i = 0; i < 15; ++i) {
      robot.drive(i < 10 + seed % 8 ? std::max(0.0, 10.2 - 0.8 * (i + 1)) : 5.0 * share(random), 0.02);
      robot.learning().resetMotion();
    }
    robot.drive(0.6 * share(random), 0.02 * (seed % 4));
    robot.ramp(7.0 * share(random), 10.2, limit, 1.9, 0.7);
    EXPECT_NEAR(robot.learning().timing().dead_time, 0.08, 0.01) << "seed " << seed;
  }
}

/// The ground takes 40 % of what the motors get of the step at once, until the integral of their velocity loops has
/// made up for it. No lag is learned.
TEST(DriveTrainLearning, LoadOfATurnIsNoLag) {
  PlantModel configured = modelWith(0.07, 0.03);
  configured.velocity_loop_integral = 0.0;
  for (const unsigned seed : {1u, 2u, 3u}) {
    DriveTrainLearning learning(configured, kRadius, kVariance);
    WheelBelief motor(configured, kRadius, {});
    std::mt19937 generator(seed);
    std::normal_distribution<double> noise(0.0, 0.012);
    double load = 0.0;
    for (int k = 1; k <= 4500; ++k) {
      const double command = k % 3500 > 500 && k % 3500 < 2500 ? 1.4 : 0.0;
      learning.predict({-command, command});
      const double before = motor.speed();
      motor.predict(command);
      load += 0.4 * (motor.speed() - before) - load * 0.001 / 0.12;
      const double speed = motor.speed() - load;
      if (k % 20 == 0) learning.correct({-speed + noise(generator), speed + noise(generator)}, 0.02);
    }
    EXPECT_NEAR(learning.timing().lag, 0.03, 0.015) << "seed " << seed;
    EXPECT_NEAR(learning.timing().dead_time, 0.07, 0.01) << "seed " << seed;
  }
}

}  // namespace
}  // namespace jackal_aic
