#include "jackal_aic/safety/command_limiter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;  // s
const GeometryParameters kGeometry{};
const SkidSteerKinematics kKinematics(kGeometry);

/// @param deceleration [m/s^2], 0: none of its own.
LimitParameters limitsOf(double acceleration, double jerk, double deceleration = 0.0) {
  LimitParameters limits;
  limits.linear_acceleration = acceleration;
  limits.linear_jerk = jerk;
  limits.linear_deceleration = deceleration;
  return limits;
}

LimitParameters withJerk() {
  LimitParameters limits = limitsOf(2.0, 10.0);
  limits.angular_acceleration = 4.0;
  limits.angular_jerk = 30.0;
  return limits;
}

WheelCommand wheels(double forward, double yaw_rate) { return kKinematics.wheelSpeeds(forward, yaw_rate); }

/// A limiter at rest, and the body velocities it passed through since.
class Drive {
 public:
  explicit Drive(const LimitParameters& limits = {}) : limiter(limits, kGeometry, kPeriod) {}

  BodyVector step(double forward, double yaw_rate) { return note(limiter.drive(wheels(forward, yaw_rate))); }
  BodyVector brake(double linear = 3.0, double angular = 6.0, double longest = 1.0) {
    return note(limiter.brake(linear, angular, longest));
  }
  BodyVector settle(double forward, double yaw_rate) {
    for (int i = 0; i < 500; ++i) step(forward, yaw_rate);
    return path.back();
  }

  double forward() const { return path.back()(kForward); }
  double yawRate() const { return path.back()(kYaw); }
  double change(std::size_t i, int channel = kForward) const { return path[i](channel) - path[i - 1](channel); }

  /// Largest difference quotient of a channel over the path, of order 1 (acceleration) or 2 (jerk).
  double steepest(int channel, int order, std::size_t from = 0) const {
    double largest = 0.0;
    for (std::size_t i = from + order; i < path.size(); ++i) {
      const double difference = change(i, channel) - (order == 2 ? change(i - 1, channel) : 0.0);
      largest = std::max(largest, std::abs(difference) / std::pow(kPeriod, order));
    }
    return largest;
  }

  CommandLimiter limiter;
  std::vector<BodyVector> path{BodyVector::Zero()};

 private:
  BodyVector note(const WheelCommand& command) {
    path.push_back(kKinematics.bodyVelocity(command));
    return path.back();
  }
};

/// Steps until the command is at the target, and stays.
int stepsTo(Drive& drive, double target) {
  const std::size_t before = drive.path.size();
  drive.settle(target, 0.0);
  std::size_t there = drive.path.size();
  while (there > before && std::abs(drive.path[there - 1](kForward) - target) < 1e-9) --there;
  return static_cast<int>(there - before) + 1;
}

TEST(CommandLimiter, ScalesSpeedsIntoTheLimitsOnTheirCurvature) {
  const double rows[][4] = {// wanted forward and yaw rate, driven ones
                            {0.5, -0.8, 0.5, -0.8},
                            {3.0, 0.0, 2.0, 0.0},
                            {-3.0, 0.0, -2.0, 0.0},
                            {0.0, 9.0, 0.0, 4.0},
                            {0.0, -9.0, 0.0, -4.0}};
  for (const auto& [forward, yaw_rate, driven, turned] : rows) {
    const BodyVector body = Drive().settle(forward, yaw_rate);
    EXPECT_NEAR(body(kForward), driven, 1e-9);
    EXPECT_NEAR(body(kYaw), turned, 1e-9);
  }
  for (const auto& [forward, yaw_rate] : {std::pair(3.0, 1.0), std::pair(-0.5, 8.0), std::pair(2.0, 4.0)}) {
    Drive drive;
    const BodyVector body = drive.settle(forward, yaw_rate);
    EXPECT_NEAR(body(kYaw) / body(kForward), yaw_rate / forward, 1e-9);
    const WheelCommand command = drive.limiter.command();
    EXPECT_NEAR(std::max({std::abs(body(kForward)) / 2.0, std::abs(body(kYaw)) / 4.0, std::abs(command.left) / 25.5,
                          std::abs(command.right) / 25.5}),
                1.0, 1e-9);
  }
  const SetPoint reachable = Drive().limiter.reachable({20.0, 1.0, -20.0});
  EXPECT_NEAR(reachable.yaw_rate / reachable.forward, -1.0, 1e-12);
  EXPECT_NEAR(reachable.forward, 25.5 * 0.098 / (1.0 + 0.5 * 0.5621), 1e-9) << "the left wheel's limit";
  EXPECT_EQ(reachable.lateral, 0.0);
}

TEST(CommandLimiter, RampsFromRestOnTheCurvatureOfTheTarget) {
  for (const bool jerk : {false, true}) {
    Drive drive(jerk ? withJerk() : LimitParameters{});
    drive.settle(1.5, 0.75);
    for (const auto& body : drive.path) EXPECT_NEAR(body(kYaw), 0.5 * body(kForward), 1e-9);
    EXPECT_NEAR(drive.path[1](kForward), jerk ? 10.0 * kPeriod * kPeriod : 0.4, 1e-9);
    EXPECT_NEAR(drive.steepest(kForward, 1), jerk ? 2.0 : 20.0, 1e-6);
    EXPECT_NEAR(drive.forward(), 1.5, 1e-9);
  }
}

TEST(CommandLimiter, BeyondZeroTheDecelerationIsTheAcceleration) {
  Drive drive(limitsOf(1.0, 0.0, 4.0));
  drive.settle(0.5, 0.0);
  EXPECT_EQ(stepsTo(drive, -0.5), 32) << "6.25 periods down, 25 up";
  for (std::size_t i = 501; i < drive.path.size(); ++i) {
    const double before = drive.path[i - 1](kForward);
    // Through zero, the share of the period that the way down leaves is acceleration.
    const double largest = before >= 0.08 ? 0.08 : before > 0.0 ? before + 0.02 * (1.0 - before / 0.08) : 0.02;
    ASSERT_NEAR(std::abs(drive.change(i)), std::min(largest, std::abs(-0.5 - before)), 1e-9) << i;
  }
  for (const double jerk : {10.0, 20.0, 60.0}) {
    Drive jerked(limitsOf(1.0, jerk, 4.0));
    jerked.settle(1.0, 0.0);
    const std::size_t reversal = jerked.path.size();
    jerked.settle(-1.0, 0.0);
    for (std::size_t i = reversal; i < jerked.path.size(); ++i) {
      if (jerked.path[i - 1](kForward) > 0.0) continue;
      ASSERT_LE(-jerked.change(i) / kPeriod, 1.0 + jerk * kPeriod + 1e-9) << jerk << " m/s^3, step " << i - reversal;
    }
    EXPECT_GT(jerked.steepest(kForward, 1, reversal), 2.0) << "on the way to zero";
    EXPECT_NEAR(jerked.forward(), -1.0, 1e-9);
    EXPECT_LE(jerked.steepest(kForward, 2), jerk * (1.0 + 1e-6));
  }
}

/// Shortest time of a change of speed within acceleration and jerk, from and to acceleration zero [s].
double optimalTime(double change, double acceleration, double jerk) {
  const double ramp = acceleration / jerk;
  return change >= acceleration * ramp ? change / acceleration + ramp : 2.0 * std::sqrt(change / jerk);
}

TEST(CommandLimiterJerk, IsAtMostAPeriodSlowerThanTheTimeOptimalProfile) {
  for (const auto& [acceleration, jerk] : {std::pair(1.0, 5.0), std::pair(2.0, 10.0), std::pair(1.8, 2.0)}) {
    for (const auto& [from, to] : {std::pair(0.0, 1.0), std::pair(0.0, 0.1), std::pair(0.0, -0.02), std::pair(1.5, 0.0),
                                   std::pair(1.0, -1.0), std::pair(-0.4, 0.9)}) {
      SCOPED_TRACE(testing::Message() << from << " -> " << to << " m/s, " << acceleration << ", " << jerk);
      Drive drive(limitsOf(acceleration, jerk));
      drive.settle(from, 0.0);
      EXPECT_LE(kPeriod * stepsTo(drive, to), optimalTime(std::abs(to - from), acceleration, jerk) + kPeriod);
      EXPECT_LE(drive.steepest(kForward, 1), acceleration + 1e-6);
      EXPECT_LE(drive.steepest(kForward, 2), jerk * (1.0 + 1e-6));
      for (const auto& body : drive.path) {
        EXPECT_LE(body(kForward), std::max(from, to) + 1e-9) << "overshoot";
        EXPECT_GE(body(kForward), std::min({from, to, 0.0}) - 1e-9);
      }
    }
  }
}

TEST(CommandLimiterJerk, CommandBeyondTheSetPointIsTheEnd) {
  Drive drive(limitsOf(1.0, 5.0)), alone(limitsOf(1.0, 5.0));
  for (int i = 0; i < 100; ++i) {
    const double forward = kKinematics.bodyVelocity(drive.limiter.drive(wheels(0.6, 0.0), SetPoint{0.1, 0.0, 0.0}))(0);
    ASSERT_NEAR(forward, alone.step(0.6, 0.0)(kForward), 1e-12) << i;
  }
  EXPECT_NEAR(alone.forward(), 0.6, 1e-9);
}

TEST(CommandLimiterJerk, HoldsInTurnsAndAfterAnUnfinishedBrake) {
  Drive drive(withJerk());
  for (const double yaw_rate : {1.0, -2.0, 0.0}) drive.settle(0.0, yaw_rate);
  EXPECT_NEAR(drive.steepest(kYaw, 2), 30.0, 1e-6);
  drive.settle(1.5, 0.0);
  for (int i = 0; i < 3; ++i) drive.brake(2.0, 4.0, 10.0);
  const std::size_t braked = drive.path.size();
  drive.settle(1.5, 0.0);
  EXPECT_LE(drive.steepest(kForward, 2, braked - 2), 10.0 + 1e-5);
  EXPECT_NEAR(drive.forward(), 1.5, 1e-9);
}

TEST(CommandLimiterJerk, WheelAtItsLimitIsUsedUp) {
  // The turn comes at once, the forward speed still rises: together they would ask too much of the right wheel.
  LimitParameters limits = limitsOf(2.0, 5.0);
  limits.wheel_speed = 10.0;  // rad/s, 0.98 m/s
  limits.angular_jerk = 1000.0;
  Drive drive(limits);
  for (int i = 0; i < 28; ++i) drive.step(0.95, 0.0);
  double fastest = 0.0;
  for (int i = 0; i < 200; ++i) {
    drive.step(0.1, 2.5);
    fastest = std::max(fastest, drive.limiter.command().right);
  }
  EXPECT_NEAR(fastest, 10.0, 1e-6);
  EXPECT_NEAR(drive.forward(), 0.1, 1e-6);
  EXPECT_NEAR(drive.yawRate(), 2.5, 1e-6);
}

TEST(CommandLimiterJerk, KeepsItsLimitsUnderRandomCommandsAndArrives) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> forward(-3.0, 3.0), yaw_rate(-6.0, 6.0);
  std::uniform_int_distribution<int> duration(1, 60);
  Drive drive(withJerk());
  for (int i = 0; i < 2000; ++i) {
    const double v = forward(random), w = yaw_rate(random);
    for (int steps = duration(random); steps > 0; --steps) {
      const BodyVector body = drive.step(v, w);
      ASSERT_LE(std::abs(body(kForward)), 2.0 + 1e-6);
      ASSERT_LE(std::abs(body(kYaw)), 4.0 + 1e-6);
      const WheelCommand command = drive.limiter.command();
      ASSERT_LE(std::max(std::abs(command.left), std::abs(command.right)), 25.5 * (1.0 + 1e-6));
    }
    if (i % 10 != 0) continue;
    drive.settle(v, w);
    const SetPoint end = drive.limiter.reachable({v, 0.0, w});
    ASSERT_NEAR(drive.forward(), end.forward, 1e-6) << i;
    ASSERT_NEAR(drive.yawRate(), end.yaw_rate, 1e-6) << i;
  }
  EXPECT_LE(drive.steepest(kForward, 1), 2.0 + 1e-6);
  EXPECT_LE(drive.steepest(kYaw, 1), 4.0 + 1e-6);
}

TEST(CommandLimiterBrake, KeepsItsTimeAndCanBeHardened) {
  Drive timed, hardened;
  timed.settle(2.0, 0.0);
  for (int i = 0; i < 10; ++i) {
    EXPECT_FALSE(timed.limiter.atRest()) << i;
    timed.brake(3.0, 6.0, 0.2);
  }
  EXPECT_TRUE(timed.limiter.atRest());
  EXPECT_LE(timed.steepest(kForward, 1), 20.0 + 1e-6);
  hardened.settle(2.0, 0.0);
  hardened.brake();
  int steps = 0;
  for (; !hardened.limiter.atRest() && steps < 100; ++steps) hardened.brake(20.0, 25.0, 1.0);
  EXPECT_EQ(steps, 5) << "1.94 m/s at 20 m/s^2";
  EXPECT_LE(hardened.steepest(kForward, 1), 20.0 + 1e-6);
}

TEST(CommandLimiterBrake, NextBrakeTakesItsOwnTime) {
  for (const bool followed : {false, true}) {
    Drive drive;
    drive.settle(2.0, 0.0);
    for (int i = 0; i < 30; ++i) drive.brake();
    if (followed) drive.limiter.follow(wheels(2.0, 0.0));
    if (!followed) drive.settle(2.0, 0.0);
    EXPECT_NEAR(drive.brake()(kForward), 2.0 - 2.0 / 34.0, 1e-9) << followed;
  }
}

}  // namespace
}  // namespace jackal_aic
