#include "jackal_aic/odometry/dead_reckoning.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "jackal_aic/odometry/odometry.hpp"

namespace jackal_aic {
namespace {

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
  EXPECT_EQ(odometry.pose().y, 0.0);
  EXPECT_EQ(odometry.pose().heading, 0.0);
}

/// A clock that jumps, or a machine that was suspended: the motion meanwhile is unknown.
TEST(Odometry, JumpsAndStallsAreLeftOut) {
  for (const double jump : {2.0, 3600.0, 1e9, -0.02, -0.03, -1e9}) {
    Odometry odometry(PredictiveParameters{}, {}, PlantModel{});
    for (int k = 0; k < 100; ++k) {
      odometry.observe({0.02 * k, 0.0, 5.0, 5.0, 0.0, 0.0});
      odometry.advance({5.0, 5.0}, 0.02);
    }
    const double before = odometry.pose().x;
    ASSERT_GT(before, 0.5);
    odometry.advance({5.0, 5.0}, jump);
    EXPECT_EQ(odometry.pose().x, before) << jump;
    for (int k = 0; k < 100; ++k) {
      odometry.observe({std::max(jump, 0.0) + 2.0 + 0.02 * k, 0.0, 5.0, 5.0, 0.0, 0.0});
      odometry.advance({5.0, 5.0}, 0.02);
    }
    EXPECT_NEAR(odometry.pose().x, 2.0 * before, 0.1 * before) << "it goes on after it";
  }
}

}  // namespace
}  // namespace jackal_aic
