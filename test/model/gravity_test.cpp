#include "jackal_aic/model/gravity.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace jackal_aic {
namespace {

TEST(GravityReaction, FollowsTheTiltAndNotTheYaw) {
  const Eigen::Quaterniond nose_up(Eigen::AngleAxisd(-0.1, Eigen::Vector3d::UnitY()));
  const Eigen::Vector3d expected(kGravity * std::sin(0.1), 0.0, kGravity * std::cos(0.1));
  EXPECT_TRUE(gravityReaction(nose_up).isApprox(expected, 1e-12));
  const Eigen::Quaterniond tilted(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1.0, -2.0, 0.0).normalized()));
  const Eigen::Quaterniond turned = Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitZ()) * tilted;
  EXPECT_TRUE(gravityReaction(turned).isApprox(gravityReaction(tilted)));
}

TEST(UnitAttitude, TakesRoundedQuaternionsAndRefusesOthers) {
  const auto rounded = unitAttitude({0.9239, 0.3827, 0.0, 0.0});
  ASSERT_TRUE(rounded);
  EXPECT_NEAR(rounded->norm(), 1.0, 1e-15);
  for (const double w : {0.0, 2.0, 1e200, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_FALSE(unitAttitude({w, 0.0, 0.0, 0.0})) << w;
  }
}

}  // namespace
}  // namespace jackal_aic
