// The odometry on the simulated robot: its covariance is that of its errors, and it drifts less than the stock
// controller's.

#include "jackal_aic/odometry/odometry.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "odometry_table.hpp"
#include "planar_ekf.hpp"

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
  EXPECT_GE(nees, std::string(controller) == "diff_drive" ? 0.15 : 0.5) << "and not much too large";
}

// The baseline has no model of the motors, and nothing tells it of the box.
INSTANTIATE_TEST_SUITE_P(ControllersAndPlants, OdometryCovariance,
                         testing::Values(std::tuple{"predictive", "ground"}, std::tuple{"predictive", "box"},
                                         std::tuple{"improved", "ground"}, std::tuple{"improved", "box"},
                                         std::tuple{"diff_drive", "ground"}));

/// Steps of up to 1 m/s and 1 rad/s every second or so, each seed by itself.
TEST(Odometry, IsAsSureInHardCyclesAsItMayBe) {
  for (const char* controller : {"predictive", "improved"}) {
    for (const char* friction : {"0.5", "0.8"}) {
      for (const std::uint64_t seed : {2u, 7u}) {
        DrivingCycle hard;
        hard.seed = seed;
        const auto figures = driveOdometry(
            kFiles, {"hard cycle", controller, "ground", cycleProfile(hard), {{"plant.friction", friction}}});
        std::printf("%s on friction %s, seed %d: NEES %.2f, %.1f %% inside\n", controller, friction,
                    static_cast<int>(seed), figures.nees, 100.0 * figures.inside);
        EXPECT_GE(figures.inside, 0.95) << controller << " on friction " << friction << ", seed " << seed;
        EXPECT_GE(figures.nees, 0.3) << "wider than it has to be";
      }
    }
  }
}

TEST(Odometry, DriftsLessThanTheStockController) {
  int drives = 0;
  double ours = 0.0, stock = 0.0, ours_filtered = 0.0, stock_filtered = 0.0;
  for (const OdometryDrive& drive : odometryDrives()) {
    const bool straight = drive.name.rfind("straight", 0) == 0;
    if (straight || !drive.overrides.empty()) continue;
    const auto figures = driveOdometry(kFiles, drive);
    EXPECT_GT(figures.way, 5.0) << drive.name;
    EXPECT_LT(figures.ours.heading, 0.1) << drive.name;
    EXPECT_LT(figures.ours.heading, figures.stock.heading + 0.03) << drive.name;
    ours += figures.ours.position;
    stock += figures.stock.position;
    ours_filtered += figures.ours_filtered.position;
    stock_filtered += figures.stock_filtered.position;
    ++drives;
  }
  EXPECT_EQ(drives, 8);
  EXPECT_LT(ours, 0.5 * stock);
  // The covariance is that of a real robot; of this one a filter could be surer.
  EXPECT_LT(ours_filtered, 0.6 * stock_filtered) << "with the gyro beside the stock controller's";
}

constexpr double kStep = 0.02, kForward = 0.5, kYawRate = 0.4;  // s, m/s, rad/s

PlanarMotion arcWith(double variance) {
  PlanarMotion arc{kForward, kYawRate};
  arc.covariance.diagonal().setConstant(variance);
  return arc;
}

TEST(PlanarEkf, FollowsAnArc) {
  PlanarEkf ekf;
  ekf.correct(arcWith(1e-18));  // surer than its own start
  constexpr int kSteps = 200;
  for (int k = 0; k < kSteps; ++k) {
    ekf.predict(kStep);
    ekf.correct(arcWith(1e-6));
  }
  const double heading = kSteps * kStep * kYawRate, radius = kForward / kYawRate;
  EXPECT_NEAR(ekf.pose().heading, heading, 1e-3);
  EXPECT_NEAR(ekf.pose().x, radius * std::sin(heading), 0.01);
  EXPECT_NEAR(ekf.pose().y, radius * (1.0 - std::cos(heading)), 0.01);
}

TEST(PlanarEkf, BelievesTheSurerOfTwoYawRates) {
  const auto headingWith = [](double odometry_variance, double gyro_variance) {
    PlanarEkf ekf;
    for (int k = 0; k < 500; ++k) {
      ekf.predict(kStep);
      ekf.correct(arcWith(odometry_variance));
      ekf.correct(0.0, gyro_variance);
    }
    return ekf.pose().heading;
  };
  const double turned = 500 * kStep * kYawRate;
  EXPECT_LT(headingWith(1.0, 1e-4), 0.05 * turned);
  EXPECT_GT(headingWith(1e-4, 1.0), 0.95 * turned);
  EXPECT_NEAR(headingWith(0.01, 0.01), 0.5 * turned, 0.05 * turned);
}

/// A clock that jumps, or a machine that was suspended: nobody knows what the robot did meanwhile.
TEST(Odometry, ATimeThatNobodySawIsLeftOut) {
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
}  // namespace jackal_aic::sim
