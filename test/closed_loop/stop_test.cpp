// From rest to a set point and back to rest: no preset winds up, none runs back after a stop, also on a robot whose
// motors are not the model's. `experiments stops` runs every case.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "stop_table.hpp"

namespace jackal_aic::sim {
namespace {

const PackageFiles& files() {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return files;
}

/// The arcs and turns on motors a little slower than the model's, and the fastest turns: what was missed once.
bool hard(const StopCase& c) {
  const bool arc = c.set_point.yaw_rate == 0.5 && c.set_point.forward > 0.0;
  const bool fast = c.set_point.yaw_rate >= 1.5 && c.set_point.forward < 1.0;
  if (c.controller == "predictive") return (c.plant == "box" && fast) || (c.limit_factor == 0.5 && arc);
  return c.plant == "ground" && c.limit_factor < 1.0 && arc;
}

/// Cases of stopCases() of a preset: those on the ground with the model's limit, the hard ones, and of the others each
/// fifth.
std::vector<StopCase> someCases(const std::string& controller) {
  std::vector<StopCase> some;
  std::size_t others = 0;
  for (const StopCase& c : stopCases()) {
    if (c.controller != controller) continue;
    if ((c.plant == "ground" && c.limit_factor == 1.0) || hard(c) || others++ % 5 == 0) some.push_back(c);
  }
  return some;
}

class Stop : public ::testing::TestWithParam<const char*> {};

TEST_P(Stop, NoPresetWindsUpOrRunsBack) {
  const auto cases = someCases(GetParam());
  ASSERT_GT(cases.size(), 3u);
  for (const StopCase& c : cases) {
    const StopOutcome outcome = runCase(files(), c);
    EXPECT_TRUE(keeps(outcome, barsOf(c)))
        << nameOf(c) << ": overshoot " << outcome.figures.excess_pct << " %, " << outcome.figures.beyond_mps
        << " m/s and " << outcome.figures.beyond_radps << " rad/s beyond zero";
  }
}

INSTANTIATE_TEST_SUITE_P(Presets, Stop, ::testing::Values("standard", "improved", "tuned", "predictive"),
                         [](const auto& info) { return info.param; });

TEST(Stop, AsPrintedTheThesisControllersWindUp) {
  // Else the cases above show nothing.
  const StopCase c{"improved", "ground", 1.0, {1.0, 0.0, 0.0}};
  EXPECT_GT(runCase(files(), c, {{"plant_model.acceleration_limit", "1000"}}).figures.excess_pct, 30.0);
}

TEST(Stop, NoiseStepsAndJitterOfTheSensorsChangeLittle) {
  for (const double factor : {0.5, 1.0}) {
    const StopCase c{"improved", "ground", factor, {1.0, 0.0, 0.0}};
    const StopOutcome outcome = runCase(files(), c, {{"plant.encoder_step", "0.1"}, {"plant.stamp_jitter", "0.01"}});
    EXPECT_TRUE(keeps(outcome, barsOf(c))) << nameOf(c) << ": overshoot " << outcome.figures.excess_pct << " %, "
                                           << outcome.figures.beyond_mps << " m/s beyond zero";
  }
}

}  // namespace
}  // namespace jackal_aic::sim
