#include "jackal_aic/drive_gate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

namespace jackal_aic {
namespace {

const LimitParameters kLimits{2.0, 4.0, 25.5};
const DeadlineParameters kDeadlines{0.5, 0.2};
const GeometryParameters kGeometry{};
const DriveGate kGate(kLimits, kDeadlines, kGeometry);

InputAges fresh() { return {0.1, 0.02, 0.02, 0.02}; }

TEST(DriveGateDecision, DrivesOnFreshInputs) {
  EXPECT_EQ(kGate.decide(fresh()).status, DriveStatus::driving);
  EXPECT_STREQ(kGate.decide(fresh()).reason, "");
}

TEST(DriveGateDecision, IsIdleUntilASetPointArrives) {
  InputAges ages = fresh();
  ages.set_point = kNever;
  EXPECT_EQ(kGate.decide(ages).status, DriveStatus::idle);
  EXPECT_EQ(kGate.decide({}).status, DriveStatus::idle);
}

TEST(DriveGateDecision, StopsWhenAnInputIsMissingOrPastItsDeadline) {
  for (double age : {0.51, kNever, -0.51}) {
    InputAges ages = fresh();
    if (age != kNever) {
      ages.set_point = age;
      EXPECT_EQ(kGate.decide(ages).status, DriveStatus::stopped) << "set point " << age;
    }
    for (double InputAges::*input : {&InputAges::wheels, &InputAges::imu, &InputAges::measurement}) {
      ages = fresh();
      ages.*input = age;
      EXPECT_EQ(kGate.decide(ages).status, DriveStatus::stopped) << age;
      EXPECT_FALSE(std::string(kGate.decide(ages).reason).empty());
    }
  }
}

TEST(DriveGateDecision, DeadlinesAreInclusiveAndSeparate) {
  InputAges ages{0.5, 0.2, 0.2, 0.2};
  EXPECT_EQ(kGate.decide(ages).status, DriveStatus::driving);
  ages.wheels = 0.21;
  EXPECT_EQ(kGate.decide(ages).status, DriveStatus::stopped);
  EXPECT_NE(std::string(kGate.decide(ages).reason).find("wheel"), std::string::npos);
  ages = {0.5, 0.2, 0.21, 0.2};
  EXPECT_NE(std::string(kGate.decide(ages).reason).find("IMU"), std::string::npos);
}

TEST(DriveGateLimit, LeavesWhatIsWithinTheLimits) {
  const WheelCommand wanted{3.0, 7.0};
  EXPECT_NEAR(kGate.limit(wanted).left, 3.0, 1e-12);
  EXPECT_NEAR(kGate.limit(wanted).right, 7.0, 1e-12);
}

TEST(DriveGateLimit, BoundsForwardSpeedAndYawRate) {
  const SkidSteerKinematics kinematics(kGeometry);
  for (double sign : {1.0, -1.0}) {
    const BodyVector fast = kinematics.bodyVelocity(kGate.limit(kinematics.wheelSpeeds(3.0 * sign, 0.0)));
    EXPECT_NEAR(fast(kForward), 2.0 * sign, 1e-12);
    EXPECT_NEAR(fast(kYaw), 0.0, 1e-12);
    const BodyVector spin = kinematics.bodyVelocity(kGate.limit(kinematics.wheelSpeeds(0.0, 9.0 * sign)));
    EXPECT_NEAR(spin(kForward), 0.0, 1e-12);
    EXPECT_NEAR(spin(kYaw), 4.0 * sign, 1e-12);
  }
}

TEST(DriveGateLimit, WheelLimitKeepsTheCurvature) {
  const SkidSteerKinematics kinematics(kGeometry);
  const WheelCommand limited = kGate.limit(kinematics.wheelSpeeds(2.0, 4.0));
  EXPECT_NEAR(std::max(std::abs(limited.left), std::abs(limited.right)), 25.5, 1e-12);
  const BodyVector body = kinematics.bodyVelocity(limited);
  EXPECT_NEAR(body(kYaw) / body(kForward), 2.0, 1e-12);
}

TEST(DriveGateLimit, WhatIsNotFiniteBecomesZero) {
  EXPECT_EQ(kGate.limit({std::numeric_limits<double>::quiet_NaN(), 1.0}), WheelCommand{});
  EXPECT_EQ(kGate.limit({1.0, std::numeric_limits<double>::infinity()}), WheelCommand{});
}

}  // namespace
}  // namespace jackal_aic
