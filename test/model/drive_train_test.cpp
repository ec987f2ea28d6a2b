#include "jackal_aic/model/drive_train.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/wheel_belief.hpp"

namespace jackal_aic {
namespace {

constexpr double kRadius = 0.098;

PlantModel model(double lag, double integral, double acceleration_limit = 1000.0) {
  return {0.05, lag, 0.9, 0.0, integral, acceleration_limit};
}

TEST(DriveTrainResponse, OfALagIsTheExponential) {
  for (const double time : {0.001, 0.02, 0.3}) {
    const DriveTrainResponse response = driveTrainResponse(model(0.05, 0.0), time);
    EXPECT_NEAR(response.transition(0, 0), std::exp(-time / 0.05), 1e-12);
    EXPECT_NEAR(response.input(0), 1.0 - std::exp(-time / 0.05), 1e-12);
    EXPECT_EQ(response.transition(0, 1), 0.0) << "without an integral there is no z";
  }
  for (const double none : {0.0, 1e-300, 1e-20, 1e-10}) {
    EXPECT_TRUE(driveTrainResponse(model(none, 5.0), 0.02).input.isApprox(Eigen::Vector2d(1.0, 0.0), 1e-9)) << none;
  }
}

PlantModel withOffset(double gain, double offset) { return {0.05, 0.04, gain, offset}; }

TEST(DeadZone, ReducesACommandAndItsInverseRestoresIt) {
  for (const double gain : {0.5, 1.0, 1.3}) {
    const DeadZone zone(withOffset(gain, 0.5)), none(withOffset(gain, 0.0));
    for (const double command : {0.0, 0.1, 0.3, 0.7, 2.0, 20.0}) {
      EXPECT_NEAR(gain * zone.effective(command), std::max(0.0, gain * command - 0.5), 1e-12);
      EXPECT_EQ(zone.effective(-command), -zone.effective(command));
      EXPECT_EQ(none.effective(-command), -command);
      EXPECT_EQ(none.command(command), command);
    }
    EXPECT_EQ(zone.command(0.0), 0.0);
    for (const double speed : {DeadZone::kSmooth, 0.1, 1.0, 20.0}) {
      EXPECT_NEAR(gain * zone.effective(zone.command(speed / gain)), speed, 1e-12);
      EXPECT_EQ(zone.command(-speed / gain), -zone.command(speed / gain));
    }
  }
}

TEST(DeadZone, InverseIsContinuous) {
  const DeadZone zone(withOffset(1.0, 0.5));
  double last = zone.command(-1.0);
  for (double v = -1.0; v <= 1.0; v += 1e-4) {
    const double command = zone.command(v);
    EXPECT_GE(command, last);
    EXPECT_LE(command - last, 1e-4 * (1.01 + 0.5 / DeadZone::kSmooth));
    EXPECT_LE(std::abs(zone.effective(command) - v), DeadZone::kSmooth) << "a slower wheel stands at worst";
    EXPECT_LE(std::abs(zone.effective(command)), std::abs(v) + 1e-12) << "never faster than wanted";
    last = command;
  }
}

TEST(DriveTrain, StepsFollowTheExactResponse) {
  const PlantModel loop = model(0.04, 8.0);
  const DriveTrain train(loop, kRadius);
  const DriveTrainResponse exact = driveTrainResponse(loop, 0.1);
  Eigen::Vector3d x(1.0, 0.2, 0.3);
  const Eigen::Vector2d expected = exact.transition * x.head<2>() + exact.input * (0.9 * 4.0 + 0.3);
  for (int k = 0; k < 100; ++k) EXPECT_FALSE(train.step(x, 4.0).limited);
  EXPECT_NEAR(x(0), expected(0), 0.005);
  EXPECT_NEAR(x(1), expected(1), 0.005);
  EXPECT_EQ(x(2), 0.3) << "a disturbance stays";
}

TEST(DriveTrain, AtItsLimitOnlyTheSpeedMoves) {
  const DriveTrain train(model(0.04, 8.0, 0.98), kRadius);  // 10 rad/s^2
  Eigen::Vector3d x(0.0, 0.1, 0.0);
  const DriveTrain::Step step = train.step(x, -20.0);
  EXPECT_TRUE(step.limited);
  EXPECT_NEAR(step.change, -0.01, 1e-12);
  EXPECT_NEAR(x(0), -0.01, 1e-12);
  EXPECT_EQ(x(1), 0.1);
}

TEST(CommandsUnderWay, ActAfterTheDeadTime) {
  for (const double dead_time : {0.0, 0.003, CommandsUnderWay::kLongestDeadTime, 5.0}) {
    CommandsUnderWay commands(dead_time);
    commands.fill(-1.0);
    const int delay = static_cast<int>(commands.delay());
    EXPECT_EQ(delay, std::lround(1000.0 * std::min(dead_time, CommandsUnderWay::kLongestDeadTime)));
    for (int k = 0; k < 5000; ++k) ASSERT_EQ(commands.step(k), k < delay ? -1.0 : k - delay) << dead_time;
  }
}

TEST(CommandsUnderWay, KeepTheLatestWhenTheDeadTimeChanges) {
  CommandsUnderWay commands(0.005);
  commands.fill(0.0);
  for (int k = 1; k <= 8; ++k) commands.step(k);  // 4..8 are under way, and 3 acts
  CommandsUnderWay shorter = commands, longer = commands;
  shorter.setDeadTime(0.002);
  EXPECT_EQ(shorter.delay(), 2u);
  for (int k = 9; k <= 20; ++k) EXPECT_EQ(shorter.step(k), k - 2);
  longer.setDeadTime(0.009);
  EXPECT_EQ(longer.delay(), 9u);
  for (int k = 9; k <= 12; ++k) EXPECT_EQ(longer.step(k), 3) << "what was given before it is forgotten";
  for (int k = 13; k <= 20; ++k) EXPECT_EQ(longer.step(k), k - 9);
}

TEST(WheelBelief, IsAtRestOfTheLoopAfterAReset) {
  WheelBelief wheel(model(0.04, 8.0), kRadius, {});
  wheel.reset(3.0);
  for (int k = 0; k < 50; ++k) wheel.predict(0.0);
  EXPECT_NEAR(wheel.speed(), 3.0, 1e-12) << "the command that drove it is still under way";
  for (int k = 0; k < 1000; ++k) wheel.predict(0.0);
  EXPECT_NEAR(wheel.speed(), 0.0, 0.01);
}

TEST(PlantModel, HasNoEffectiveTrackOrOneThatARobotMayHave) {
  const auto read = [](double track) {
    ParameterMap map;
    map.set("plant_model.dead_time", 0.1);
    map.set("plant_model.lag", 0.02);
    map.set("plant_model.effective_track", track);
    return readPlantModel(map).effective_track;
  };
  for (const double track : {0.0, 0.05, 0.55, 5.0}) EXPECT_EQ(read(track), track);
  for (const double track : {1e-300, 0.001, 0.0499, 5.1, -0.1}) EXPECT_THROW(read(track), ParameterError) << track;
}

TEST(ConfidenceBox, HasACornerForEveryEndOfTheIntervals) {
  PlantModel model;
  EXPECT_EQ(confidenceBox(model).size(), 1U) << "no interval is stated";
  model.dead_time_half_width = 0.01;
  model.gain_half_width = 0.05;
  const std::vector<PlantModel> corners = confidenceBox(model);
  ASSERT_EQ(corners.size(), 4U);
  int early = 0, weak = 0;
  for (const PlantModel& corner : corners) {
    EXPECT_NEAR(std::abs(corner.dead_time - model.dead_time), 0.01, 1e-12);
    EXPECT_NEAR(std::abs(corner.gain - model.gain), 0.05, 1e-12);
    EXPECT_EQ(corner.lag, model.lag);
    early += corner.dead_time < model.dead_time;
    weak += corner.gain < model.gain;
  }
  EXPECT_EQ(early, 2);
  EXPECT_EQ(weak, 2);
}

TEST(ConfidenceBox, StaysWithinWhatAModelMayBe) {
  PlantModel model;
  model.dead_time_half_width = model.lag_half_width = model.offset_half_width = 0.5;
  model.gain_half_width = 2.0;
  model.offset = 0.3;
  for (const PlantModel& corner : confidenceBox(model)) {
    EXPECT_GE(corner.dead_time, 0.0);
    EXPECT_GE(corner.lag, 0.0);
    EXPECT_GE(corner.gain, 0.1);
    EXPECT_GE(corner.offset, 0.0);
  }
}

}  // namespace
}  // namespace jackal_aic
