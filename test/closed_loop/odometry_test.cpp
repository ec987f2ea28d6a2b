// The odometry on the simulated robot: its covariance is that of its errors, and it drifts less than the stock
// controller's.

#include <gtest/gtest.h>

#include <string>

#include "odometry_table.hpp"

namespace jackal_aic::sim {
namespace {

const PackageFiles kFiles{JACKAL_AIC_SOURCE_DIR};

OdometryFigures cycle(const std::string& controller, const std::string& plant, std::uint64_t seed) {
  DrivingCycle cycle;
  cycle.seed = seed;
  cycle.segments = 12;
  return driveOdometry(
      kFiles, {"driving cycle", controller, plant, cycleProfile(cycle), {{"plant.seed", std::to_string(seed)}}});
}

/// Beside any controller: the predictive one has the belief, the others have one beside them.
class OdometryCovariance : public testing::TestWithParam<std::tuple<const char*, const char*>> {};

TEST_P(OdometryCovariance, IsThatOfTheErrors) {
  const auto [controller, plant] = GetParam();
  constexpr int kRuns = 4;
  double nees = 0.0, inside = 0.0;
  for (int seed = 1; seed <= kRuns; ++seed) {
    const auto figures = cycle(controller, plant, static_cast<std::uint64_t>(seed));
    nees += figures.nees / kRuns;
    inside += figures.inside / kRuns;
  }
  RecordProperty("nees", std::to_string(nees));
  std::printf("%s on the %s: NEES %.2f, %.1f %% inside\n", controller, plant, nees, 100.0 * inside);
  EXPECT_GE(inside, 0.95) << "of the time within the 95 % bounds";
  EXPECT_LE(nees, 2.5) << "2 if the covariance is right, more if it is too small";
  // Who has no model of the motors cannot be as sure.
  EXPECT_GE(nees, std::string(controller) == "diff_drive" ? 0.25 : 0.5) << "and not much too large";
}

// The baseline has no model of the motors, and nothing tells it of the box.
INSTANTIATE_TEST_SUITE_P(ControllersAndPlants, OdometryCovariance,
                         testing::Values(std::tuple{"predictive", "ground"}, std::tuple{"predictive", "box"},
                                         std::tuple{"improved", "ground"}, std::tuple{"improved", "box"},
                                         std::tuple{"diff_drive", "ground"}));

TEST(Odometry, DriftsLessThanTheStockController) {
  int drives = 0;
  double ours = 0.0, stock = 0.0;
  for (const OdometryDrive& drive : odometryDrives()) {
    const bool straight = drive.name.rfind("straight", 0) == 0;
    if (straight || !drive.overrides.empty()) continue;
    const auto figures = driveOdometry(kFiles, drive);
    EXPECT_GT(figures.way, 5.0) << drive.name;
    EXPECT_LT(figures.ours.heading, 0.1) << drive.name;
    EXPECT_LT(figures.ours.heading, figures.stock.heading + 0.03) << drive.name;
    ours += figures.ours.position;
    stock += figures.stock.position;
    ++drives;
  }
  EXPECT_EQ(drives, 8);
  EXPECT_LT(ours, 0.5 * stock);
}

}  // namespace
}  // namespace jackal_aic::sim
