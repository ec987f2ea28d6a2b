#include "motor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace jackal_aic::sim {
namespace {

constexpr double kStep = 0.001, kRadius = 1.0;  // s, m

PlantParameters parameters() {
  PlantParameters p;
  p.motor_lag = 0.035;
  p.velocity_loop_integral = 0.0;
  p.acceleration_limit = 1e6;
  p.speed_limit = 1e6;
  return p;
}

/// Wheel speed after a time under a constant command, by a drive train that always reaches its reference.
double speedAfter(MotorLoop& motor, double command, double duration, double speed = 0.0) {
  for (long n = std::lround(duration / kStep); n > 0; --n) speed = motor.reference(command, speed);
  return speed;
}

TEST(CommandDelay, ActsAfterTheDeadTimeInOrder) {
  CommandDelay delay(0.110, kStep), at_once(0.0, kStep), late(0.010, kStep);
  delay.push(5, {1.0, 2.0});
  delay.push(8, {3.0, 3.0});
  delay.push(8, {4.0, 4.0});
  EXPECT_EQ(delay.acting(114), WheelCommand{});
  EXPECT_EQ(delay.acting(115), (WheelCommand{1.0, 2.0}));
  EXPECT_EQ(delay.acting(117).left, 1.0);
  EXPECT_EQ(delay.acting(118).left, 4.0);
  EXPECT_EQ(delay.acting(1000).left, 4.0);
  at_once.push(7, {1.0, 1.0});
  EXPECT_EQ(at_once.acting(7).left, 1.0);
  late.push(0, {1.0, 1.0}, 15);
  late.push(5, {2.0, 2.0}, 2);
  EXPECT_EQ(late.acting(24), WheelCommand{});
  EXPECT_EQ(late.acting(25), (WheelCommand{2.0, 2.0})) << "both come at once";
}

TEST(MotorLoop, FollowsThePiLoopsStepResponse) {
  // T w'' + w' + k w = k r, w(0) = 0, w'(0) = r/T: poles of the closed loop of the class comment.
  PlantParameters p = parameters();
  p.velocity_loop_integral = 3.0;
  MotorLoop motor(p, kRadius, kStep);
  const double root = std::sqrt(1.0 - 4.0 * p.motor_lag * p.velocity_loop_integral);
  const double slow = (-1.0 + root) / (2.0 * p.motor_lag), fast = (-1.0 - root) / (2.0 * p.motor_lag);
  const double a = (1.0 / p.motor_lag + fast) / (slow - fast), b = -1.0 - a;
  double speed = 0.0;
  for (int n = 1; n <= 2000; ++n) {
    speed = motor.reference(1.0, speed);
    const double t = n * kStep;
    EXPECT_NEAR(speed, 1.0 + a * std::exp(slow * t) + b * std::exp(fast * t), 2e-3) << t;
  }
}

TEST(MotorLoop, AccelerationLimitDoesNotWindUpTheIntegral) {
  PlantParameters p = parameters();
  p.acceleration_limit = 5.0;
  p.velocity_loop_integral = 5.0;
  MotorLoop limited(p, kRadius, kStep);
  double speed = 0.0, highest = 0.0;
  for (int n = 0; n < 5000; ++n) {
    speed = limited.reference(8.0, speed);
    highest = std::max(highest, speed);
  }
  EXPECT_NEAR(speed, 8.0, 1e-3);
  // Integrating during the 1.6 s of acceleration would add more than 8 rad/s.
  EXPECT_LT(highest, 8.0 * 1.1);
}

TEST(MotorLoop, OffsetSlowsTheWheelAndIsADeadBand) {
  PlantParameters p = parameters();
  p.wheel_offset = 0.5;
  p.velocity_loop_integral = 5.0;
  MotorLoop forward(p, kRadius, kStep), backward(p, kRadius, kStep), weak(p, kRadius, kStep);
  EXPECT_NEAR(speedAfter(forward, 3.0, 3.0), 2.5, 1e-6);
  EXPECT_NEAR(speedAfter(backward, -3.0, 3.0), -2.5, 1e-6);
  EXPECT_EQ(speedAfter(weak, 0.5, 3.0), 0.0);
}

}  // namespace
}  // namespace jackal_aic::sim
