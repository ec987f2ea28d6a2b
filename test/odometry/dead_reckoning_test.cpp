#include "jackal_aic/odometry/dead_reckoning.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace jackal_aic {
namespace {

TEST(DeadReckoning, GoesStraight) {
  DeadReckoning odometry;
  for (int i = 0; i < 100; ++i) odometry.advance({0.5, 0.0}, 0.02);
  EXPECT_NEAR(odometry.pose().x, 1.0, 1e-12);
  EXPECT_EQ(odometry.pose().y, 0.0);
  EXPECT_EQ(odometry.pose().heading, 0.0);
}

TEST(DeadReckoning, AnArcIsExactForEveryStep) {
  constexpr double kForward = 0.6, kYawRate = 0.8, kTime = 2.0;
  for (int steps : {1, 7, 2000}) {
    DeadReckoning odometry;
    for (int i = 0; i < steps; ++i) odometry.advance({kForward, kYawRate}, kTime / steps);
    const double radius = kForward / kYawRate, turned = kYawRate * kTime;
    EXPECT_NEAR(odometry.pose().x, radius * std::sin(turned), 1e-9) << steps;
    EXPECT_NEAR(odometry.pose().y, radius * (1.0 - std::cos(turned)), 1e-9) << steps;
    EXPECT_NEAR(odometry.pose().heading, turned, 1e-12) << steps;
  }
}

TEST(DeadReckoning, LeavesOutWhatIsNotFinite) {
  DeadReckoning odometry;
  odometry.advance({1.0, 0.0}, 1.0);
  odometry.advance({std::numeric_limits<double>::quiet_NaN(), 0.0}, 1.0);
  odometry.advance({1.0, std::numeric_limits<double>::infinity()}, 1.0);
  EXPECT_EQ(odometry.pose().x, 1.0);
  EXPECT_EQ(odometry.pose().heading, 0.0);
}

}  // namespace
}  // namespace jackal_aic
