// From rest to a set point and back to rest: no preset winds up, none runs back after a stop, also on a robot whose
// motors are not the model's. `experiments stops` runs every case.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "stop_table.hpp"

namespace jackal_aic::sim {
namespace {

const PackageFiles& files() {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return files;
}

/// Turns of the predictive controller on the box, or by motors of half the model's limit.
bool ofItsOwn(const StopCase& c) {
  return c.controller == "predictive" && c.set_point.yaw_rate != 0.0 && (c.plant == "box" || c.limit_factor < 1.0);
}

/// Cases of stopCases() of a preset; of those on the box and on other robots than the model's, each fifth. Without
/// those that have a test of their own.
std::vector<StopCase> someCases(const std::string& controller) {
  std::vector<StopCase> some;
  std::size_t others = 0;
  for (const StopCase& c : stopCases()) {
    if (c.controller != controller || ofItsOwn(c)) continue;
    if ((c.plant == "ground" && c.limit_factor == 1.0) || others++ % 5 == 0) some.push_back(c);
  }
  return some;
}

class Stop : public ::testing::TestWithParam<const char*> {};

TEST_P(Stop, NoPresetWindsUpOrRunsBack) {
  for (const StopCase& c : someCases(GetParam())) {
    const StopFigures figures = runCase(files(), c);
    EXPECT_TRUE(keeps(figures, barsOf(c)))
        << nameOf(c) << ": overshoot " << figures.overshoot_pct << " %, " << figures.beyond_mps << " m/s and "
        << figures.beyond_radps << " rad/s beyond zero";
  }
}

INSTANTIATE_TEST_SUITE_P(Presets, Stop, ::testing::Values("standard", "improved", "tuned", "predictive"),
                         [](const auto& info) { return info.param; });

TEST(Stop, ThePredictiveControllerTurnsOnALittle) {
  // On the box its command takes the wheels' lag out beforehand and meets limits.angular_acceleration there: up to
  // 0.068 rad/s beyond zero, where the others keep 0.05. Of motors of half the model's limit it learns a wrong
  // effective track on the way: up to 18 % overshoot of a yaw rate, where the others keep 15 %.
  for (const SetPoint& turn : {SetPoint{0.0, 0.0, 2.0}, SetPoint{0.3, 0.0, 1.5}, SetPoint{1.0, 0.0, 0.5}}) {
    for (const auto& [plant, factor] : {std::pair("box", 1.0), std::pair("box", 0.5), std::pair("ground", 0.5)}) {
      const StopCase c{"predictive", plant, factor, turn};
      StopBars bars = barsOf(c);
      bars.beyond_radps = std::max(bars.beyond_radps, 0.07);
      bars.overshoot_pct = std::max(bars.overshoot_pct, factor < 1.0 ? 19.0 : 0.0);
      const StopFigures figures = runCase(files(), c);
      EXPECT_TRUE(keeps(figures, bars)) << nameOf(c) << ": overshoot " << figures.overshoot_pct << " %, "
                                        << figures.beyond_radps << " rad/s beyond zero";
    }
  }
}

TEST(Stop, AsPrintedTheThesisControllersWindUp) {
  // Else the cases above show nothing.
  const StopCase c{"improved", "ground", 1.0, {1.0, 0.0, 0.0}};
  EXPECT_GT(runCase(files(), c, {{"plant_model.acceleration_limit", "1000"}}).overshoot_pct, 30.0);
}

TEST(Stop, NoiseStepsAndJitterOfTheSensorsChangeLittle) {
  for (const double factor : {0.5, 1.0}) {
    const StopCase c{"improved", "ground", factor, {1.0, 0.0, 0.0}};
    const StopFigures figures = runCase(files(), c, {{"plant.encoder_step", "0.1"}, {"plant.stamp_jitter", "0.01"}});
    EXPECT_TRUE(keeps(figures, barsOf(c)))
        << nameOf(c) << ": overshoot " << figures.overshoot_pct << " %, " << figures.beyond_mps << " m/s beyond zero";
  }
}

}  // namespace
}  // namespace jackal_aic::sim
