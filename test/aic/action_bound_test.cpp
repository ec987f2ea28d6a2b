#include "jackal_aic/aic/action_bound.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <random>

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;  // s
constexpr double kRadius = 0.098;
constexpr double kLimit = 1.65 / kRadius;  // rad/s^2
constexpr double kRamp = kLimit * kPeriod;

PlantModel ground() {
  PlantModel model;
  model.dead_time = 0.08;
  model.lag = 0.00636;
  model.acceleration_limit = 1.65;
  return model;
}

ActionBound bound() { return {ground(), kRadius, kPeriod}; }

/// What the motor of a wheel is, where it differs from the model.
struct Motor {
  double limit_factor = 1.0;
  int delay = 4;  // periods
  double gain = 1.0;
  double noise = 0.03;  // rad/s
  double encoder_step = 0.0;
  double jitter = 0.0;  // s
  double load = 0.0;    // rad/s by which it stays behind
};

/// Ramps a command to `target`, holds it, and counts the periods in which the wheel counts as late.
int latePeriods(const Motor& motor, double target, double ramp = kRamp, double offset = 0.0) {
  PlantModel model = ground();
  model.offset = offset;
  WheelLateness wheel(model, kLimit, kPeriod);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, motor.noise);
  std::uniform_real_distribution<double> jitter(-motor.jitter, motor.jitter);
  std::deque<double> way(static_cast<std::size_t>(motor.delay), 0.0);
  double command = 0.0, speed = 0.0;
  int late = 0;
  for (int k = 0; k < 200; ++k) {
    command = std::min(target, command + ramp);
    wheel.command(command);
    way.push_back(command);
    const double acting = std::max(0.0, motor.gain * way.front() - motor.load);
    way.pop_front();
    speed += std::clamp(acting - speed, -motor.limit_factor * kRamp, motor.limit_factor * kRamp);
    double measured = speed + noise(random);
    if (motor.encoder_step > 0.0) measured = motor.encoder_step * std::round(measured / motor.encoder_step);
    wheel.observe(k * kPeriod + jitter(random), measured);
    if (wheel.late() > 0) ++late;
    EXPECT_GE(wheel.late(), 0) << "on its way up";
  }
  return late;
}

TEST(WheelLateness, AMotorOfHalfTheModelsLimitIsLateUntilItIsThere) {
  for (const double step : {0.0, 0.06, 0.1}) {
    Motor slow;
    slow.limit_factor = 0.5;
    slow.encoder_step = step;
    slow.jitter = step > 0.0 ? 0.004 : 0.0;
    const int way = static_cast<int>(10.0 / (0.5 * kRamp));
    EXPECT_GT(latePeriods(slow, 10.0), way - 14) << "encoder step " << step;
    EXPECT_LT(latePeriods(slow, 10.0), way) << "encoder step " << step;
  }
}

TEST(WheelLateness, AMotorLikeTheModelsIsNot) {
  for (const double step : {0.0, 0.06, 0.1}) {
    Motor motor;
    motor.encoder_step = step;
    motor.jitter = 0.004;
    EXPECT_EQ(latePeriods(motor, 10.0), 0) << "encoder step " << step;
    motor.limit_factor = 2.0;
    EXPECT_EQ(latePeriods(motor, 10.0), 0) << "twice the limit, encoder step " << step;
  }
}

TEST(WheelLateness, AMotorWithTheModelsOffsetIsNot) {
  Motor motor;
  motor.load = 1.0;
  EXPECT_EQ(latePeriods(motor, 10.0, 0.5 * kRamp, motor.load), 0);
  EXPECT_GT(latePeriods(motor, 10.0, 0.5 * kRamp), 0) << "of one that has none it would be";
}

TEST(WheelLateness, AWeakGainIsTakenForASlowMotorUntilItsWheelIsThereAndNoLonger) {
  // While a wheel accelerates, nothing tells one from the other.
  Motor weak;
  weak.gain = 0.8;
  const int way = static_cast<int>(10.0 / kRamp);
  EXPECT_LE(latePeriods(weak, 10.0), way + 4) << "a window of samples after the end of the ramp";
  weak.delay = 6;
  EXPECT_LE(latePeriods(weak, 10.0), way + 4);
}

TEST(WheelLateness, AMotorALittleSlowerThanTheModelsIsLateBeforeItIsThere) {
  for (const double factor : {0.7, 0.8, 0.9}) {
    Motor slow;
    slow.limit_factor = factor;
    EXPECT_GT(latePeriods(slow, 15.0), 2) << factor;
  }
}

TEST(WheelLateness, DeadTimeAndLoadAreNoLateness) {
  Motor loaded;
  loaded.load = 3.0;
  EXPECT_EQ(latePeriods(loaded, 10.0, 0.1 * kRamp), 0) << "stays behind by 3 rad/s";
  Motor blocked;
  blocked.limit_factor = 0.0;
  EXPECT_EQ(latePeriods(blocked, 10.0), 0) << "blocked";
}

TEST(ActionBound, LeavesWhatTheMotorsCanFollowToTheBit) {
  ActionBound bound = ::jackal_aic::bound();
  WheelVector action(3.0, 3.0);
  for (int k = 0; k < 100; ++k) bound.apply(action);
  for (int k = 0; k < 50; ++k) {
    const WheelVector wanted = action + WheelVector(0.9 * kRamp, -0.2 * kRamp) * std::sin(0.3 * k);
    ASSERT_EQ(bound.bound(action, wanted, {4.0, 3.0}), wanted) << k;
    action = wanted;
    bound.apply(action);
  }
}

TEST(ActionBound, RampsWithTheMotorsOnTheCurvature) {
  ActionBound bound = ::jackal_aic::bound();
  WheelVector action = WheelVector::Zero();
  for (int k = 1; k <= 50; ++k) {
    action = bound.bound(action, action + WheelVector(2.0, 4.0), {10.0, 20.0});
    bound.apply(action);
    EXPECT_NEAR(action(0), 0.5 * action(1), 1e-9);
    EXPECT_NEAR(action(1), (k + 1) * kRamp, 1e-9) << "a period ahead of the motor";
  }
}

TEST(ActionBound, WhileAWheelRampsTheActionStaysAtTheGoal) {
  ActionBound bound = ::jackal_aic::bound();
  WheelVector action = WheelVector::Zero();
  Observation y;
  double speed = 0.0;
  for (int k = 0; k < 60; ++k) {
    action = bound.bound(action, action + WheelVector(2.0, 2.0), {5.0, 5.0});
    bound.apply(action);
    if (k >= 4) speed = std::min(5.0, speed + 0.9 * kRamp);
    y.stamp = k * kPeriod;
    y.wheel_left = y.wheel_right = speed;
    bound.observe(y, {});
    if (speed < 4.5) {
      EXPECT_LE(action(0), 5.0) << k;
    }
  }
  EXPECT_GT(action(0), 5.0) << "a wheel that rests is no ramp";
}

TEST(ActionBound, WithoutAModelThereIsNone) {
  ActionBound bound(std::nullopt, kRadius, kPeriod);
  const WheelVector wanted(500.0, -300.0);
  EXPECT_EQ(bound.bound(WheelVector::Zero(), wanted, WheelVector::Zero()), wanted);
}

TEST(ActionBound, AStopEndsAtZeroWhileTheWheelMoves) {
  PlantModel quick = ground();
  quick.acceleration_limit = 100.0;
  ActionBound bound(quick, kRadius, kPeriod);
  Observation moving;
  moving.wheel_left = moving.wheel_right = 10.0;
  WheelVector action(10.0, 10.0);
  bound.observe(moving, {});
  bound.apply(action);
  bound.bound(action, action, {10.0, 10.0});
  int periods = 0;
  for (; action(0) > 0.0 && periods < 100; ++periods) {
    const WheelVector next = bound.bound(action, action - WheelVector(3.0, 3.0), WheelVector::Zero());
    EXPECT_GE(next(0), 0.0) << "reverses while the wheel moves";
    action = next;
    bound.apply(action);
  }
  EXPECT_NEAR(periods * kPeriod, ActionBound::kShortestStop, 1e-9);
  moving.stamp = 1.0;
  moving.wheel_left = moving.wheel_right = 0.1;
  bound.observe(moving, {});
  EXPECT_LT(bound.bound(action, {-0.1, -0.1}, WheelVector::Zero())(0), 0.0) << "at rest it holds the robot";
}

TEST(ActionBound, AWheelThatIsNotMeasuredIsNotJudged) {
  for (const bool measured : {true, false}) {
    ActionBound bound = ::jackal_aic::bound();
    ChannelValidity valid;
    valid.wheel_left = measured;
    WheelVector action = WheelVector::Zero();
    Observation y;
    for (int k = 0; k < 28; ++k) {
      action = bound.bound(action, action + WheelVector(2.0, 2.0), {5.0, 5.0});
      bound.apply(action);
      y.stamp = k * kPeriod;
      y.wheel_left = y.wheel_right = 0.5 * kRamp * std::max(0, k - 4);
      bound.observe(y, valid);
    }
    EXPECT_EQ(action(0) <= 5.0, measured) << action(0);
    EXPECT_LE(action(1), 5.0);
  }
}

}  // namespace
}  // namespace jackal_aic
