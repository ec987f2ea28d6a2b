#include "jackal_aic/predictive/drive_train_learning.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

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

/// Both wheels of a robot with a drive train, of which a DriveTrainLearning with another one hears.
class LearningFromARobot {
 public:
  LearningFromARobot(const PlantModel& robot, const PlantModel& told, double noise = 0.03)
      : robot_(robot, kRadius), learning_(told, kRadius, kVariance), noise_(0.0, noise) {
    robot_.reset(0.0);
  }

  /// Gives a command to both wheels [rad/s] for a time [s]. Returns how often the timing was changed.
  int drive(double command, double seconds) {
    int changes = 0;
    for (long k = 0; k < std::lround(1000.0 * seconds); ++k) {
      learning_.predict({command, command}, {robot_.speed(), robot_.speed()});
      robot_.predict(command);
      if (++steps_ % std::lround(kSamplePeriod) != 0) continue;
      const double y = robot_.speed() + noise_(generator_);
      if (learning_.correct({y, y + noise_(generator_)}, 0.001 * kSamplePeriod)) ++changes;
    }
    return changes;
  }

  DriveTrainLearning& learning() { return learning_; }

 private:
  DriveTrainPrediction robot_;
  DriveTrainLearning learning_;
  std::mt19937 generator_{1};
  std::normal_distribution<double> noise_;
  long steps_ = 0;
};

TEST(DriveTrainLearning, FindsADeadTimeFarOff) {
  for (const double truth : {0.03, 0.08, 0.16, 0.3}) {
    for (const double told : {0.0, 0.08, 0.24}) {
      LearningFromARobot robot(modelWith(truth, 0.03), modelWith(told, 0.03));
      for (const double command : {5.0, 0.0, 3.0, -5.0, 0.0}) robot.drive(command, 2.0);
      EXPECT_NEAR(robot.learning().timing().dead_time, truth, 0.0065) << "told " << told;
      EXPECT_NEAR(robot.learning().timing().lag, 0.03, 0.01) << truth << ", told " << told;
    }
  }
}

TEST(DriveTrainLearning, TellsTheLagFromTheDeadTime) {
  // Beyond the limit a lag delays a ramp as a dead time does; it shows where a motion begins and ends.
  LearningFromARobot robot(modelWith(0.08, 0.12), modelWith(0.08, 0.03));
  for (int i = 0; i < 15; ++i) robot.drive(i % 2 == 0 ? 5.0 : -2.0, 2.0);
  const DriveTrainTiming timing = robot.learning().timing();
  EXPECT_NEAR(timing.dead_time + timing.lag, 0.2, 0.02) << "a change of less than 9 ms is not taken over";
  EXPECT_NEAR(timing.lag, 0.12, 0.02);
}

TEST(DriveTrainLearning, KeepsATimingThatIsRight) {
  for (const double noise : {0.0, 0.03, 0.1}) {
    LearningFromARobot robot(modelWith(0.08, 0.03), modelWith(0.08, 0.03), noise);
    int changes = 0;
    for (int i = 0; i < 50; ++i) changes += robot.drive(i % 3 == 0 ? 5.0 : i % 3 == 1 ? 1.0 : -3.0, 1.7);
    EXPECT_EQ(changes, 0) << noise;
  }
}

TEST(DriveTrainLearning, LearnsNothingWithoutExcitation) {
  LearningFromARobot robot(modelWith(0.16, 0.03), modelWith(0.08, 0.03));
  EXPECT_EQ(robot.drive(0.0, 60.0), 0);
  EXPECT_EQ(robot.drive(0.2, 60.0), 0) << "less than what counts as a change";
}

TEST(DriveTrainLearning, GainOffsetAndLimitOfTheMotorsAreNoDeadTime) {
  const auto with = [](auto change) {
    PlantModel robot = modelWith(0.08, 0.03);
    change(robot);
    LearningFromARobot driven(robot, modelWith(0.08, 0.03));
    for (int i = 0; i < 12; ++i) driven.drive(i % 3 == 0 ? 5.0 : i % 3 == 1 ? 2.0 : -4.0, 2.0);
    return driven.learning().timing();
  };
  EXPECT_NEAR(with([](PlantModel& robot) { robot.gain = 0.8; }).dead_time, 0.08, 0.01);
  EXPECT_NEAR(with([](PlantModel& robot) { robot.gain = 1.2; }).dead_time, 0.08, 0.01);
  EXPECT_NEAR(with([](PlantModel& robot) { robot.offset = 0.5; }).dead_time, 0.08, 0.01);
  EXPECT_NEAR(with([](PlantModel& robot) { robot.acceleration_limit *= 0.6; }).dead_time, 0.08, 0.01);
  EXPECT_NEAR(with([](PlantModel& robot) { robot.acceleration_limit *= 3.0; }).dead_time, 0.08, 0.01);
}

TEST(DriveTrainLearning, GoesOnFromAnotherTiming) {
  LearningFromARobot robot(modelWith(0.16, 0.03), modelWith(0.08, 0.03));
  robot.learning().setTiming({0.16, 0.03});
  EXPECT_EQ(robot.learning().timing().dead_time, 0.16);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(robot.drive(i % 2 == 0 ? 5.0 : 0.0, 2.0), 0);
}

TEST(DriveTrainLearning, AMotionThatIsForgottenTeachesNothing) {
  LearningFromARobot robot(modelWith(0.16, 0.03), modelWith(0.08, 0.03));
  robot.drive(0.0, 3.0);
  robot.drive(5.0, 0.5);
  robot.learning().forgetMotion();
  EXPECT_EQ(robot.drive(5.0, 1.0), 0);
}

}  // namespace
}  // namespace jackal_aic
