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

/// Accelerations [m/s^2], [rad/s^2]. @param deceleration [m/s^2], 0: none of its own.
LimitParameters limitsOf(double linear, double angular, double deceleration = 0.0) {
  LimitParameters limits;
  limits.linear_acceleration = linear;
  limits.angular_acceleration = angular;
  limits.linear_deceleration = deceleration;
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

  /// Largest acceleration of a channel over the path.
  double steepest(int channel) const {
    double largest = 0.0;
    for (std::size_t i = 1; i < path.size(); ++i) largest = std::max(largest, std::abs(change(i, channel)) / kPeriod);
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
  Drive drive;
  drive.settle(1.5, 0.75);
  for (const auto& body : drive.path) EXPECT_NEAR(body(kYaw), 0.5 * body(kForward), 1e-9);
  EXPECT_NEAR(drive.path[1](kForward), 0.4, 1e-9);
  EXPECT_NEAR(drive.steepest(kForward), 20.0, 1e-6);
  EXPECT_NEAR(drive.forward(), 1.5, 1e-9);
}

TEST(CommandLimiter, BeyondZeroTheDecelerationIsTheAcceleration) {
  Drive drive(limitsOf(1.0, 25.0, 4.0));
  drive.settle(0.5, 0.0);
  EXPECT_EQ(stepsTo(drive, -0.5), 32) << "6.25 periods down, 25 up";
  for (std::size_t i = 501; i < drive.path.size(); ++i) {
    const double before = drive.path[i - 1](kForward);
    // Through zero, the share of the period that the way down leaves is acceleration.
    const double largest = before >= 0.08 ? 0.08 : before > 0.0 ? before + 0.02 * (1.0 - before / 0.08) : 0.02;
    ASSERT_NEAR(std::abs(drive.change(i)), std::min(largest, std::abs(-0.5 - before)), 1e-9) << i;
  }
}

TEST(CommandLimiter, KeepsItsLimitsUnderRandomCommandsAndArrives) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> forward(-3.0, 3.0), yaw_rate(-6.0, 6.0);
  std::uniform_int_distribution<int> duration(1, 60);
  Drive drive(limitsOf(2.0, 4.0));
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
  EXPECT_LE(drive.steepest(kForward), 2.0 + 1e-6);
  EXPECT_LE(drive.steepest(kYaw), 4.0 + 1e-6);
}

TEST(CommandLimiterBrake, KeepsItsTimeAndCanBeHardened) {
  Drive timed, hardened;
  timed.settle(2.0, 0.0);
  for (int i = 0; i < 10; ++i) {
    EXPECT_FALSE(timed.limiter.atRest()) << i;
    timed.brake(3.0, 6.0, 0.2);
  }
  EXPECT_TRUE(timed.limiter.atRest());
  EXPECT_LE(timed.steepest(kForward), 20.0 + 1e-6);
  hardened.settle(2.0, 0.0);
  hardened.brake();
  int steps = 0;
  for (; !hardened.limiter.atRest() && steps < 100; ++steps) hardened.brake(20.0, 25.0, 1.0);
  EXPECT_EQ(steps, 5) << "1.94 m/s at 20 m/s^2";
  EXPECT_LE(hardened.steepest(kForward), 20.0 + 1e-6);
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
