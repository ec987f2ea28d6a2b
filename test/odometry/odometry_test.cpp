// Odometry across a jump of time.

#include "jackal_aic/odometry/odometry.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace jackal_aic {
namespace {

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
