#include "jackal_aic/model/skid_steer_kinematics.hpp"

#include <gtest/gtest.h>

namespace jackal_aic {
namespace {

constexpr double r = 0.098;
constexpr double b = 0.5621;

TEST(SkidSteerKinematics, MatricesAreThoseOfTheThesis) {
  const SkidSteerKinematics kinematics({r, b, 1.0}), half({r, b, 0.5});
  Eigen::Matrix<double, 3, 2> forward_matrix;  // (3-2)
  forward_matrix << r / 2, r / 2, 0, 0, -r / b, r / b;
  EXPECT_TRUE(kinematics.forwardMatrix().isApprox(forward_matrix, 1e-14));
  Eigen::Matrix<double, 5, 3> sensory_map;  // (3-4)
  sensory_map << 0, 0, 1, 1 / r, 0, -b / (2 * r), 1 / r, 0, b / (2 * r), 0, 0, 0, 0, 0, 0;
  EXPECT_TRUE(kinematics.sensoryMap().isApprox(sensory_map, 1e-14));
  Eigen::Matrix<double, 2, 5> forward_model;  // (3-14)
  forward_model << -r / b, 1, 0, 0, 0, r / b, 0, 1, 0, 0;
  EXPECT_TRUE(kinematics.forwardModel().isApprox(forward_model, 1e-14));
  // The slip factor scales every wheel term.
  EXPECT_TRUE(half.forwardMatrix().isApprox(0.5 * forward_matrix, 1e-14));
  EXPECT_TRUE(half.sensoryMap().middleRows(1, 2).isApprox(2.0 * sensory_map.middleRows(1, 2), 1e-14));
  EXPECT_DOUBLE_EQ(half.sensoryMap()(kYawRate, kYaw), 1.0);
  const WheelCommand wheels = half.wheelSpeeds(0.7, 1.3);
  const BodyVector body(0.7, 0.0, 1.3);
  EXPECT_TRUE((half.forwardMatrix() * wheels.vector()).isApprox(body, 1e-14)) << "wheelSpeeds() is the inverse";
  EXPECT_TRUE(half.bodyVelocity(wheels).isApprox(body, 1e-14));
}

}  // namespace
}  // namespace jackal_aic
