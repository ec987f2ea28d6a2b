#include "jackal_aic/command_limiter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;  // s
const GeometryParameters kGeometry{};
const SkidSteerKinematics kKinematics(kGeometry);
const double kNaN = std::numeric_limits<double>::quiet_NaN();

LimitParameters withJerk() {
  LimitParameters limits;
  limits.linear_acceleration = 2.0;
  limits.angular_acceleration = 4.0;
  limits.linear_jerk = 10.0;
  limits.angular_jerk = 30.0;
  return limits;
}

WheelCommand wheels(double forward, double yaw_rate) { return kKinematics.wheelSpeeds(forward, yaw_rate); }

/// A limiter at rest, and the body velocities it passed through since.
class Drive {
 public:
  explicit Drive(const LimitParameters& limits = {}) : limiter(limits, kGeometry, kPeriod) {}

  BodyVector step(double forward, double yaw_rate) { return note(limiter.drive(wheels(forward, yaw_rate))); }
  BodyVector brake(double linear, double angular, double longest) {
    return note(limiter.brake(linear, angular, longest));
  }
  BodyVector settle(double forward, double yaw_rate) {
    for (int i = 0; i < 500; ++i) step(forward, yaw_rate);
    return path.back();
  }

  /// Largest difference quotient of a channel over the path, of order 1 (acceleration) or 2 (jerk).
  double steepest(int channel, int order) const {
    double largest = 0.0;
    for (std::size_t i = order; i < path.size(); ++i) {
      const double first = path[i](channel) - path[i - 1](channel);
      const double second = order == 2 ? first - (path[i - 1](channel) - path[i - 2](channel)) : 0.0;
      largest = std::max(largest, order == 2 ? std::abs(second) / (kPeriod * kPeriod) : std::abs(first) / kPeriod);
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

TEST(CommandLimiterSpeed, LeavesWhatIsWithinTheLimits) {
  Drive drive;
  const BodyVector body = drive.settle(0.5, -0.8);
  EXPECT_NEAR(body(kForward), 0.5, 1e-12);
  EXPECT_NEAR(body(kYaw), -0.8, 1e-12);
}

TEST(CommandLimiterSpeed, BoundsEachAxisInBothDirections) {
  for (double sign : {1.0, -1.0}) {
    EXPECT_NEAR(Drive().settle(3.0 * sign, 0.0)(kForward), 2.0 * sign, 1e-9);
    EXPECT_NEAR(Drive().settle(0.0, 9.0 * sign)(kYaw), 4.0 * sign, 1e-9);
  }
}

TEST(CommandLimiterSpeed, KeepsTheCurvatureAtEveryLimit) {
  for (const auto& [forward, yaw_rate] : {std::pair(3.0, 1.0), std::pair(-0.5, 8.0), std::pair(2.0, 4.0)}) {
    Drive drive;
    const BodyVector body = drive.settle(forward, yaw_rate);
    EXPECT_NEAR(body(kYaw) / body(kForward), yaw_rate / forward, 1e-9);
    EXPECT_NEAR(
        std::max({std::abs(body(kForward)) / 2.0, std::abs(body(kYaw)) / 4.0,
                  std::abs(drive.limiter.command().left) / 25.5, std::abs(drive.limiter.command().right) / 25.5}),
        1.0, 1e-9);
  }
}

TEST(CommandLimiterSpeed, ASetPointIsScaledOnItsCurvature) {
  const Drive drive;
  const SetPoint reachable = drive.limiter.reachable({20.0, 1.0, -20.0});
  EXPECT_NEAR(reachable.yaw_rate / reachable.forward, -1.0, 1e-12);
  EXPECT_NEAR(reachable.forward, 25.5 * 0.098 / (1.0 + 0.5 * 0.5621), 1e-9) << "the left wheel's limit";
  EXPECT_EQ(reachable.lateral, 0.0);
}

TEST(CommandLimiterAcceleration, RampsFromRestOnTheCurvatureOfTheTarget) {
  Drive drive;
  for (int i = 0; i < 10; ++i) {
    const BodyVector body = drive.step(1.5, 1.5);
    EXPECT_NEAR(body(kYaw), body(kForward), 1e-12) << "step " << i;
  }
  EXPECT_NEAR(drive.path[1](kForward), 0.4, 1e-12) << "20 m/s^2 in a step of 20 ms";
  EXPECT_NEAR(drive.steepest(kForward, 1), 20.0, 1e-9);
  EXPECT_NEAR(drive.path.back()(kForward), 1.5, 1e-12);
}

TEST(CommandLimiterAcceleration, NoAxisExceedsItsOwn) {
  Drive drive;
  drive.settle(1.0, 1.0);
  drive.settle(-1.0, 3.0);
  drive.settle(0.2, -3.5);
  EXPECT_LE(drive.steepest(kForward, 1), 20.0 + 1e-6);
  EXPECT_LE(drive.steepest(kYaw, 1), 25.0 + 1e-6);
  EXPECT_NEAR(drive.path.back()(kForward), 0.2, 1e-9);
  EXPECT_NEAR(drive.path.back()(kYaw), -3.5, 1e-9);
}

TEST(CommandLimiterAcceleration, ZeroIsNoBound) {
  LimitParameters limits;
  limits.linear_acceleration = limits.angular_acceleration = 0.0;
  Drive drive(limits);
  EXPECT_NEAR(drive.step(1.9, 0.2)(kForward), 1.9, 1e-12);
}

TEST(CommandLimiterJerk, ArrivesWithoutOvershootWithinJerkAndAcceleration) {
  for (double target : {1.0, -0.3, 0.02}) {
    Drive drive(withJerk());
    drive.settle(target, 0.0);
    EXPECT_NEAR(drive.path.back()(kForward), target, 1e-9);
    EXPECT_LE(drive.steepest(kForward, 1), 2.0 + 1e-6);
    EXPECT_LE(drive.steepest(kForward, 2), 10.0 * (1.0 + 1e-6));
    for (const auto& body : drive.path) EXPECT_LE(std::abs(body(kForward)), std::abs(target) + 1e-9);
  }
}

TEST(CommandLimiterJerk, KeepsTheCurvatureFromRestToAnArc) {
  Drive drive(withJerk());
  drive.settle(1.0, 0.5);
  for (const auto& body : drive.path) EXPECT_NEAR(body(kYaw), 0.5 * body(kForward), 1e-9);
}

TEST(CommandLimiterJerk, SpeedAndAccelerationHoldUnderRandomWishes) {
  std::mt19937 random(7);
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
  }
  EXPECT_LE(drive.steepest(kForward, 1), 2.0 + 1e-6);
  EXPECT_LE(drive.steepest(kYaw, 1), 4.0 + 1e-6);
}

TEST(CommandLimiterBrake, RampsToZeroInEqualStepsOnTheCurvature) {
  Drive drive;
  drive.settle(1.2, 0.6);
  const std::size_t start = drive.path.size() - 1;
  for (int i = 0; i < 20; ++i) {
    const BodyVector body = drive.brake(3.0, 6.0, 1.0);
    EXPECT_NEAR(body(kForward), 1.2 - 3.0 * kPeriod * (i + 1), 1e-9);
    EXPECT_NEAR(body(kYaw), 0.5 * body(kForward), 1e-9);
  }
  EXPECT_TRUE(drive.limiter.atRest()) << "1.2 m/s at 3 m/s^2 take 0.4 s";
  EXPECT_EQ(drive.path.size(), start + 21);
  EXPECT_EQ(drive.limiter.command(), WheelCommand{});
}

TEST(CommandLimiterBrake, TakesNoLongerThanItMay) {
  Drive drive;
  drive.settle(2.0, 0.0);
  for (int i = 0; i < 10; ++i) {
    EXPECT_FALSE(drive.limiter.atRest()) << i;
    drive.brake(3.0, 6.0, 0.2);
  }
  EXPECT_TRUE(drive.limiter.atRest());
  EXPECT_LE(drive.steepest(kForward, 1), 20.0 + 1e-6);
}

TEST(CommandLimiterBrake, CanBeMadeHarderOnTheWay) {
  Drive drive;
  drive.settle(2.0, 0.0);
  drive.brake(3.0, 6.0, 1.0);
  int steps = 0;
  for (; !drive.limiter.atRest() && steps < 100; ++steps) drive.brake(20.0, 25.0, 1.0);
  EXPECT_EQ(steps, 5) << "1.94 m/s at 20 m/s^2";
  EXPECT_LE(drive.steepest(kForward, 1), 20.0 + 1e-6);
}

TEST(CommandLimiterBrake, AtRestItStaysThere) {
  Drive drive;
  EXPECT_EQ(drive.brake(3.0, 6.0, 1.0), BodyVector(BodyVector::Zero()));
  EXPECT_TRUE(drive.limiter.atRest());
}

TEST(CommandLimiterBrake, DrivingOnAfterwardsStartsFromZero) {
  Drive drive;
  drive.settle(2.0, 1.0);
  while (!drive.limiter.atRest()) drive.brake(3.0, 6.0, 1.0);
  drive.step(2.0, 1.0);
  EXPECT_NEAR(drive.path.back()(kForward), 0.4, 1e-9);
}

TEST(CommandLimiter, WhatIsNotFiniteBrakesAtTheAccelerationLimit) {
  for (double bad : {kNaN, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::max()}) {
    Drive drive;
    drive.settle(1.0, 0.0);
    drive.limiter.drive({bad, bad});
    const BodyVector body = kKinematics.bodyVelocity(drive.limiter.command());
    EXPECT_TRUE(body.allFinite());
    EXPECT_LE(std::abs(body(kForward) - 1.0), 0.4 + 1e-9);
  }
  Drive drive;
  drive.settle(1.0, 0.0);
  for (int i = 0; i < 3; ++i) drive.limiter.drive({kNaN, 1.0});
  EXPECT_TRUE(drive.limiter.atRest());
}

}  // namespace
}  // namespace jackal_aic
