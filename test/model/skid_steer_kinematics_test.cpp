#include "jackal_aic/model/skid_steer_kinematics.hpp"

#include <gtest/gtest.h>

namespace jackal_aic {
namespace {

constexpr double r = 0.098;
constexpr double b = 0.5621;

TEST(SkidSteerKinematics, ForwardMatrixIsEquation32) {
  Eigen::Matrix<double, 3, 2> expected;
  expected << r / 2, r / 2, 0, 0, -r / b, r / b;
  EXPECT_TRUE(SkidSteerKinematics({r, b, 1.0}).forwardMatrix().isApprox(expected, 1e-14));
}

TEST(SkidSteerKinematics, SensoryMapIsEquation34) {
  Eigen::Matrix<double, 5, 3> expected;
  expected << 0, 0, 1, 1 / r, 0, -b / (2 * r), 1 / r, 0, b / (2 * r), 0, 0, 0, 0, 0, 0;
  EXPECT_TRUE(SkidSteerKinematics({r, b, 1.0}).sensoryMap().isApprox(expected, 1e-14));
}

TEST(SkidSteerKinematics, ForwardModelIsEquation314) {
  Eigen::Matrix<double, 2, 5> expected;
  expected << -r / b, 1, 0, 0, 0, r / b, 0, 1, 0, 0;
  EXPECT_TRUE(SkidSteerKinematics({r, b, 1.0}).forwardModel().isApprox(expected, 1e-14));
}

TEST(SkidSteerKinematics, SlipScalesEveryWheelTerm) {
  const SkidSteerKinematics full({r, b, 1.0});
  const SkidSteerKinematics half({r, b, 0.5});
  EXPECT_TRUE(half.forwardMatrix().isApprox(0.5 * full.forwardMatrix(), 1e-14));
  EXPECT_TRUE(half.sensoryMap().middleRows(1, 2).isApprox(2.0 * full.sensoryMap().middleRows(1, 2), 1e-14));
  EXPECT_DOUBLE_EQ(half.sensoryMap()(kYawRate, kYaw), 1.0);
}

TEST(SkidSteerKinematics, WheelSpeedsInvertTheForwardMatrix) {
  const SkidSteerKinematics kinematics({r, b, 0.9});
  const BodyVector body = kinematics.bodyVelocity(kinematics.wheelSpeeds(0.7, -1.3));
  EXPECT_NEAR(body(kForward), 0.7, 1e-14);
  EXPECT_NEAR(body(kLateral), 0.0, 1e-14);
  EXPECT_NEAR(body(kYaw), -1.3, 1e-14);
}

TEST(SkidSteerKinematics, SensoryMapPredictsTheWheelsThatMakeTheMotion) {
  const SkidSteerKinematics kinematics({r, b, 1.0});
  const WheelCommand wheels{2.0, 5.0};
  const SensorVector y = kinematics.sensoryMap() * kinematics.bodyVelocity(wheels);
  EXPECT_NEAR(y(kWheelLeft), wheels.left, 1e-12);
  EXPECT_NEAR(y(kWheelRight), wheels.right, 1e-12);
  EXPECT_GT(y(kYawRate), 0.0) << "a faster right wheel turns left";
}

}  // namespace
}  // namespace jackal_aic
