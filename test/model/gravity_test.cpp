#include "jackal_aic/model/gravity.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace jackal_aic {
namespace {

TEST(GravityReaction, PointsUpAndForwardWhereTheNosePointsUp) {
  const Eigen::Quaterniond nose_up(Eigen::AngleAxisd(-0.1, Eigen::Vector3d::UnitY()));
  const Eigen::Vector3d reaction = gravityReaction(nose_up);
  EXPECT_NEAR(reaction.x(), kGravity * std::sin(0.1), 1e-12);
  EXPECT_NEAR(reaction.y(), 0.0, 1e-12);
  EXPECT_NEAR(reaction.z(), kGravity * std::cos(0.1), 1e-12);
}

TEST(GravityReaction, DoesNotKnowTheYaw) {
  const Eigen::Quaterniond tilted(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1.0, -2.0, 0.0).normalized()));
  const Eigen::Quaterniond turned = Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitZ()) * tilted;
  EXPECT_TRUE(gravityReaction(turned).isApprox(gravityReaction(tilted)));
}

TEST(UnitAttitude, TakesRoundedQuaternionsAndRefusesWhatIsNone) {
  const auto rounded = unitAttitude({0.9239, 0.3827, 0.0, 0.0});
  ASSERT_TRUE(rounded);
  EXPECT_NEAR(rounded->norm(), 1.0, 1e-15);
  EXPECT_FALSE(unitAttitude({0.0, 0.0, 0.0, 0.0}));
  EXPECT_FALSE(unitAttitude({2.0, 0.0, 0.0, 0.0}));
  EXPECT_FALSE(unitAttitude({1e200, 0.0, 0.0, 0.0}));
  EXPECT_FALSE(unitAttitude({std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0, 1.0}));
}

}  // namespace
}  // namespace jackal_aic
