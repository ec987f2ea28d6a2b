#include "jackal_aic/predictive/motion_uncertainty.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kRadius = 0.098, kPeriod = 0.02, kTick = 0.001;  // m, s, s
constexpr double kBelieved = 1e-6;

double forward(const MotionUncertainty& u, double speed = 0.0, double yaw_rate = 0.0) {
  return u.forwardVariance(kBelieved, {speed, 0.0, yaw_rate});
}

double yaw(const MotionUncertainty& u, double yaw_rate = 0.0, double offset = 0.0) {
  return u.yawVariance(kBelieved, {0.0, 0.0, yaw_rate}, offset);
}

TEST(MotionUncertainty, GrowsAndFallsWithinBoundsByTheInnovationsOfItsOwnSensor) {
  MotionUncertainty u(kRadius, false);
  for (int i = 0; i < 500; ++i) u.learnWheels(2.0, kPeriod);
  EXPECT_NEAR(forward(u), 4.0 * kBelieved, 0.01 * kBelieved);
  EXPECT_NEAR(yaw(u), kBelieved, 1e-12);
  for (int i = 0; i < 500; ++i) {
    u.learnWheels(0.25, kPeriod);
    u.learnGyro(8.0, kPeriod);
  }
  EXPECT_NEAR(forward(u), 0.5 * kBelieved, 0.01 * kBelieved);
  EXPECT_NEAR(yaw(u), 16.0 * kBelieved, 0.01 * kBelieved);
  for (int i = 0; i < 1000; ++i) {
    u.learnWheels(0.0, kPeriod);
    u.learnGyro(1e9, kPeriod);
  }
  EXPECT_NEAR(forward(u), MotionUncertainty::kLeastFactor * kBelieved, 1e-12);
  EXPECT_NEAR(yaw(u), MotionUncertainty::kLargestFactor * kBelieved, 1e-9);
}

TEST(MotionUncertainty, IncludesTheRadiusOfTheTyresAndTheOffsetOfTheGyro) {
  const MotionUncertainty u(kRadius, false);
  EXPECT_NEAR(std::sqrt(forward(u, 1.0) - kBelieved), MotionUncertainty::kRadiusDeviation, 1e-9);
  EXPECT_NEAR(std::sqrt(forward(u, -2.0) - kBelieved), 2.0 * MotionUncertainty::kRadiusDeviation, 1e-9);
  EXPECT_NEAR(yaw(u, 0.0, -0.003), kBelieved + 9e-6, 1e-12);
}

TEST(MotionUncertainty, SlipOutlastsTheAccelerationOfTheWheels) {
  MotionUncertainty u(kRadius, false);
  constexpr double kAcceleration = 10.0;  // rad/s^2
  for (int i = 0; i < 300; ++i) u.predict(kAcceleration, kAcceleration, kTick);
  const double slip = MotionUncertainty::kSlipTime * kRadius * kAcceleration;  // s = T dv/dt
  EXPECT_NEAR(std::sqrt(forward(u) - kBelieved), slip, 1e-3 * slip);
  EXPECT_NEAR(yaw(u), kBelieved, 1e-12) << "straight on";
  for (int i = 0; i < 30; ++i) u.predict(0.0, 0.0, kTick);
  EXPECT_NEAR(std::sqrt(forward(u) - kBelieved), std::exp(-1.0) * slip, 0.03 * slip);
  u.resetMotion();
  EXPECT_NEAR(forward(u), kBelieved, 1e-12);
}

TEST(MotionUncertainty, UnevenTurnsMoveTheCentreOfTurning) {
  MotionUncertainty even(kRadius, false), uneven(even);
  for (int i = 0; i < 500; ++i) {
    even.learnTurn(i % 2 == 0 ? 0.45 : 0.55, 0.5, kPeriod);
    uneven.learnTurn(i % 2 == 0 ? 0.35 : 0.65, 0.5, kPeriod);
  }
  EXPECT_NEAR(std::sqrt(forward(even, 0.0, 1.0) - kBelieved), MotionUncertainty::kCentreDeviation, 1e-9);
  EXPECT_GT(std::sqrt(forward(uneven, 0.0, 1.0)), 0.1);
  EXPECT_GT(std::sqrt(yaw(uneven, 1.0)), 0.05);
  EXPECT_NEAR(yaw(even, 1.0), kBelieved, 1e-12);
  EXPECT_NEAR(forward(uneven), kBelieved, 1e-12) << "straight on";
  const double before = forward(uneven, 0.0, 1.0);
  uneven.resetMotion();
  EXPECT_EQ(forward(uneven, 0.0, 1.0), before) << "the ground is the same";
}

}  // namespace
}  // namespace jackal_aic
