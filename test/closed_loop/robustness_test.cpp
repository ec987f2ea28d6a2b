// A step on robots that are drawn over everything in which a real one differs from its model: a small part of
// `experiments robustness`.

#include "robustness.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "parallel.hpp"

namespace jackal_aic::sim {
namespace {

constexpr std::uint64_t kSeed = 1;
constexpr std::size_t kRobots = 20;

const PackageFiles& files() {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return files;
}

TEST(Reality, IsDrawnBySeedWithinItsBounds) {
  EXPECT_EQ(drawReality(3), drawReality(3));
  EXPECT_NE(drawReality(3), drawReality(4));
  std::set<std::string> offsets;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const PlantParameters robot = loadSetup(files(), "predictive", "real", drawReality(seed)).plant;
    EXPECT_GE(robot.wheel_radius_left, 0.095);
    EXPECT_LE(robot.wheel_radius_left, 0.098);
    EXPECT_EQ(robot.imu_rate, 80.0) << "as plant_real.yaml has it";
    EXPECT_EQ(robot.seed, seed);
    offsets.insert(std::to_string(robot.wheel_offset));
  }
  EXPECT_GE(offsets.size(), 19u) << "each its own";
}

TEST(Robustness, PredictiveSettlesNearlyAlwaysAndIsAlwaysStable) {
  std::vector<RobustnessRun> runs(kRobots);
  parallelFor(kRobots, 0, [&](std::size_t i) { runs[i] = runRobustness(files(), "predictive", kSeed + i); });
  const RobustnessSummary sum = summarise(runs, robustnessBars(files()));
  EXPECT_EQ(sum.runs, kRobots);
  EXPECT_EQ(sum.unstable, 0u);
  EXPECT_GE(sum.settled, kRobots - 1);
}

TEST(Robustness, CountsWhatKeepsItsBars) {
  RobustnessRun good{true, 1.0, 0.7, 1.0, -2.0}, late{true, 1.2, 0.7, -2.1, 3.1}, wild;
  const RobustnessSummary sum = summarise({good, late, wild}, robustnessBars(files()));
  EXPECT_EQ(sum.runs, 3u);
  EXPECT_EQ(sum.unstable, 1u);
  EXPECT_EQ(sum.settled, 1u);
  EXPECT_EQ(sum.exact, 1u);
  EXPECT_EQ(sum.believed, 1u);
}

// The disturbance belief must not take for a disturbance what a soft motor still has to catch up.
TEST(Robustness, PredictiveHardlyOvershootsInTurnsWithSoftMotors) {
  EXPECT_EQ(drawSoftMotorTurn(3).robot, drawSoftMotorTurn(3).robot);
  std::vector<double> overshoot(2 * kRobots);
  parallelFor(overshoot.size(), 0, [&](std::size_t i) {
    overshoot[i] = turnOvershoot(files(), "predictive", kSeed + i).value_or(HUGE_VAL);
  });
  std::sort(overshoot.begin(), overshoot.end());
  EXPECT_LE(overshoot[overshoot.size() * 95 / 100 - 1], files().bar("robustness.soft_motor_overshoot"));
  EXPECT_LT(overshoot.front(), 5.0);
}

TEST(Robustness, NeedsADraw) { EXPECT_THROW(writeRobustnessTable(files(), 0, 1, ".", 1), ParameterError); }

}  // namespace
}  // namespace jackal_aic::sim
