#include "jackal_aic/aic/action_bound.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

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

ActionBound bound() { return {ground(), {}, kPeriod}; }

Observation measured(double stamp, double left, double right) { return {stamp, 0.0, left, right, 0.0, 0.0}; }

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

TEST(ActionBound, ActionStaysAtTheGoalWhileAWheelRamps) {
  ActionBound bound = ::jackal_aic::bound();
  WheelVector action = WheelVector::Zero();
  double speed = 0.0;
  for (int k = 0; k < 60; ++k) {
    action = bound.bound(action, action + WheelVector(2.0, 2.0), {5.0, 5.0});
    bound.apply(action);
    if (k >= 4) speed = std::min(5.0, speed + 0.9 * kRamp);
    bound.observe(measured(k * kPeriod, speed, speed), {});
    if (speed < 4.5) EXPECT_LE(action(0), 5.0) << k;
  }
  EXPECT_GT(action(0), 5.0) << "a wheel that rests is no ramp";
}

/// An arc: the left wheel follows, the right one has half the model's acceleration.
TEST(ActionBound, WheelsRampTogether) {
  ActionBound bound = ::jackal_aic::bound();
  const WheelVector goal(5.0, 10.0);
  WheelVector action = WheelVector::Zero();
  for (int k = 0; k < 40; ++k) {
    // Behind by more, the right wheel is pressed more.
    action = bound.bound(action, action + WheelVector(0.1, 1.0), goal);
    bound.apply(action);
    const double right = 0.5 * kRamp * k;
    bound.observe(measured(k * kPeriod, std::min(action(0), right), right), {});
    if (k > 10 && right < goal(1)) EXPECT_LE(action(1) / goal(1), action(0) / goal(0) + 0.2) << k;
  }
}

TEST(ActionBound, StopEndsAtZeroWhileTheWheelMoves) {
  PlantModel quick = ground();
  quick.acceleration_limit = 100.0;
  ActionBound bound(quick, {}, kPeriod);
  WheelVector action(10.0, 10.0);
  bound.observe(measured(0.0, 10.0, 10.0), {});
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
  bound.observe(measured(1.0, 0.1, 0.1), {});
  EXPECT_LT(bound.bound(action, {-0.1, -0.1}, WheelVector::Zero())(0), 0.0) << "at rest it holds the robot";
}

}  // namespace
}  // namespace jackal_aic
