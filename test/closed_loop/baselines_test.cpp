// The published controllers beside which the predictive one is shown: each tracks through the drive loop, and the
// figures by which they are tuned are those of the loop. `experiments baselines` tunes and compares all of them.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>

#include "baseline_table.hpp"
#include "closed_loop.hpp"
#include "jackal_aic/certificate/certificate.hpp"
#include "result_table.hpp"

namespace jackal_aic::sim {
namespace {

const PackageFiles& files() {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return files;
}

LoopSetup setupOn(const std::string& plant, const Overrides& overrides = {}) {
  return loadSetup(files(), "predictive", plant, overrides);
}

std::vector<Baseline> structures() {
  return comparedStructures(std::get<PredictiveParameters>(setupOn("ground").drive.controller));
}

const Baseline& named(const std::string& name) {
  static const auto list = structures();
  const auto found = std::find_if(list.begin(), list.end(), [&](const Baseline& b) { return b.name == name; });
  if (found == list.end()) throw ParameterError("no structure " + name);
  return *found;
}

/// Makes a structure as the search starts with it.
ControllerMaker started(const Baseline& structure, const LoopSetup& setup, const PlantModel& model) {
  return [&structure, model, geometry = setup.drive.geometry] {
    return structure.make(structure.start(), model, geometry);
  };
}

LoopFigures figuresOn(const Baseline& structure, const LoopSetup& setup, const PlantModel& robot) {
  return loopFigures(started(structure, setup, withoutLimit(*setup.drive.plant_model)), robot, setup.drive.geometry);
}

class EveryBaseline : public testing::TestWithParam<const char*> {};

TEST_P(EveryBaseline, TracksThroughTheDriveLoopWithoutSteadyStateErrorOnARobotThatIsNotItsModel) {
  for (const char* plant : {"box", "ground"}) {
    LoopSetup setup = setupOn(plant, {{"plant.wheel_gain", "0.85"}, {"plant.dead_time", "0.095"}});
    setup.structure = started(named(GetParam()), setup, *setup.drive.plant_model);
    for (const SetPoint& target : {SetPoint{0.5, 0.0, 0.0}, SetPoint{0.0, 0.0, 0.5}}) {
      const ResultRow row = runSetup(setup, stepProfile(target.forward, target.yaw_rate, 8.0)).row;
      // In a turn on the ground only what learns the effective track has none.
      const bool slips = target.yaw_rate != 0.0 && plant == std::string("ground");
      ASSERT_TRUE(row.steady_error_pct) << plant;
      EXPECT_NEAR(*row.steady_error_pct, 0.0, slips ? 4.0 : 1.0) << plant << ", " << target.yaw_rate << " rad/s";
    }
  }
}

class EveryLinearBaseline : public EveryBaseline {};

TEST_P(EveryLinearBaseline, IsUnstableBeyondItsGainMarginAndStableBelow) {
  const LoopSetup setup = setupOn("ground");
  const PlantModel model = *setup.drive.plant_model;
  const double margin = figuresOn(named(GetParam()), setup, model).gain_margin;
  ASSERT_GT(margin, 1.2);
  PlantModel robot = model;
  robot.gain = 0.97 * margin;
  EXPECT_TRUE(figuresOn(named(GetParam()), setup, robot).stable);
  robot.gain = 1.03 * margin;
  EXPECT_FALSE(figuresOn(named(GetParam()), setup, robot).stable);
}

TEST_P(EveryBaseline, StandsItsDelayMargin) {
  const LoopSetup setup = setupOn("ground");
  const double margin = figuresOn(named(GetParam()), setup, *setup.drive.plant_model).delay_margin;
  ASSERT_GT(margin, 0.03);
  PlantModel robot = *setup.drive.plant_model;
  const double dead_time = robot.dead_time;
  robot.dead_time = dead_time + 0.9 * std::min(margin, 1.0);
  EXPECT_TRUE(figuresOn(named(GetParam()), setup, robot).stable) << margin;
  if (margin > 1.0) return;
  robot.dead_time = dead_time + 1.1 * margin;
  EXPECT_FALSE(figuresOn(named(GetParam()), setup, robot).stable) << margin;
}

TEST_P(EveryBaseline, HasAnErrorAfterADisturbanceThatNobodyBeats) {
  for (const char* plant : {"box", "ground"}) {
    const LoopSetup setup = setupOn(plant);
    const PlantModel model = *setup.drive.plant_model;
    EXPECT_GT(figuresOn(named(GetParam()), setup, model).iae, leastLinearIae(model, setup.drive.geometry)) << plant;
  }
}

constexpr const char* kLinear[] = {"simc_pi", "simc_pid", "pid", "smith_pi", "lqg", "adrc", "mpc", "delayed_inference"};

INSTANTIATE_TEST_SUITE_P(Structures, EveryLinearBaseline, testing::ValuesIn(kLinear),
                         [](const auto& info) { return info.param; });
INSTANTIATE_TEST_SUITE_P(Structures, EveryBaseline, testing::ValuesIn(kLinear),
                         [](const auto& info) { return info.param; });
INSTANTIATE_TEST_SUITE_P(Predictive, EveryBaseline, testing::Values("predictive"),
                         [](const auto& info) { return info.param; });

TEST(Baselines, EveryOneIsTested) { EXPECT_EQ(structures().size(), 10u); }

/// The predictive controller believes less of its sensor while a wheel accelerates: large steps are not linear.
TEST(LoopFigures, OfThePredictiveControllerAreThoseOfItsCertificate) {
  for (const char* plant : {"box", "ground"}) {
    const LoopSetup setup = setupOn(plant);
    const PlantModel model = *setup.drive.plant_model;
    const LinearLoop loop(std::get<PredictiveParameters>(setup.drive.controller), model, model);
    const LoopFigures figures = figuresOn(named("predictive"), setup, model);
    EXPECT_LT(loop.spectralRadius(LoopMode::straight, {0.98 * figures.gain_margin, 0.0}), 1.0) << plant;
    EXPECT_GT(loop.spectralRadius(LoopMode::straight, {1.02 * figures.gain_margin, 0.0}), 1.0) << plant;
    EXPECT_LT(loop.spectralRadius(LoopMode::straight, {1.0, 0.9 * figures.delay_margin}), 1.0) << plant;
    EXPECT_GT(loop.spectralRadius(LoopMode::straight, {1.0, 1.1 * figures.delay_margin}), 1.0) << plant;
  }
}

/// An integral controller of a motor that follows at once: L(z) = k T z/(z - 1) z^-5 with four periods of dead time
/// and the one in which a command acts.
TEST(LoopFigures, OfAnIntegralControllerAreThoseOfItsTransferFunction) {
  LoopSetup setup = setupOn(
      "ground",
      {{"plant_model.dead_time", "0.08"}, {"plant_model.lag", "0"}, {"plant_model.velocity_loop_integral", "0"}});
  const PlantModel model = *setup.drive.plant_model;
  const double gain = 4.0, period = 0.02;
  const LoopFigures figures = loopFigures(
      [&] {
        return named("pid").make({1e-9, gain, 1e-9}, model, setup.drive.geometry);
      },
      model, setup.drive.geometry);
  double peak = 0.0, power = 0.0;
  for (double angle = 1e-3; angle < 3.1415; angle += 1e-3) {
    const std::complex<double> z = std::polar(1.0, angle), loop = gain * period * z / (z - 1.0) * std::pow(z, -5.0);
    peak = std::max(peak, std::abs(1.0 / (1.0 + loop)));
    power += 1e-3 / 3.14159265 * std::norm(gain * period * z / (z - 1.0) / (1.0 + loop));
  }
  EXPECT_NEAR(figures.peak_sensitivity, peak, 0.002 * peak);
  // Phase -pi where -pi/2 + angle/2 - 5 angle = -pi: angle = pi/9; there |L| = k T / (2 sin(angle/2)).
  EXPECT_NEAR(figures.gain_margin, 2.0 * std::sin(3.14159265 / 18.0) / (gain * period), 0.01);
  EXPECT_NEAR(figures.noise, std::sqrt(power), 0.01 * std::sqrt(power));
  // The integral of the error after a step d is d / k, and it is not negative.
  EXPECT_NEAR(figures.iae, 1.0 / gain, 0.02);
}

TEST(Tuning, FindsTheLeastErrorWithinTheBounds) {
  const LoopSetup setup = setupOn("ground");
  const Baseline& pi = named("simc_pi");
  const PlantModel model = withoutLimit(*setup.drive.plant_model);
  const GeometryParameters& geometry = setup.drive.geometry;
  const RobustnessBounds bounds;
  const TunedBaseline tuned = tune(pi, model, geometry, bounds, pi.start());
  EXPECT_TRUE(keeps(tuned.figures, bounds));
  EXPECT_GT(tuned.figures.peak_sensitivity, 0.99 * bounds.peak_sensitivity);
  const auto faster = [&] { return pi.make({0.9 * tuned.values[0]}, model, geometry); };
  EXPECT_FALSE(keeps(loopFigures(faster, model, geometry), bounds));
}

TEST(Tuning, AtEqualRobustnessThePredictiveControllerIsAsGoodAsLqgOnTheGroundAndNotOnTheFront) {
  // What doc/evidence.md says: behind the Smith predictor in the error, ahead of it where the dead time is longer.
  const LoopSetup setup = setupOn("ground");
  const PlantModel model = withoutLimit(*setup.drive.plant_model);
  const GeometryParameters& geometry = setup.drive.geometry;
  const auto tuned = [&](const char* name) { return tune(named(name), model, geometry, {}, named(name).start()); };
  const TunedBaseline predictive = tuned("predictive"), lqg = tuned("lqg"), smith = tuned("smith_pi");
  EXPECT_NEAR(predictive.figures.iae, lqg.figures.iae, 0.03 * lqg.figures.iae);
  EXPECT_GT(predictive.figures.iae, smith.figures.iae);
  EXPECT_LT(predictive.figures.iae, 1.15 * smith.figures.iae);
  PlantModel robot = model;
  robot.dead_time *= 1.5;
  const auto peak = [&](const char* name, const TunedBaseline& t) {
    return loopFigures([&] { return named(name).make(t.values, model, geometry); }, robot, geometry).peak_sensitivity;
  };
  EXPECT_LT(1.3 * peak("predictive", predictive), peak("smith_pi", smith));
}

}  // namespace
}  // namespace jackal_aic::sim
