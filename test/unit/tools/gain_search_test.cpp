#include "gain_search.hpp"

#include <gtest/gtest.h>

#include "package_files.hpp"
#include "plant_conversion.hpp"

namespace jackal_aic {
namespace {

const std::string kPackage = JACKAL_AIC_SOURCE_DIR;

/// A small search on a robot on a box.
GainSearchTask smallTask() {
  GainSearchTask task;
  task.start = readControllerFile(kPackage + "/config/improved.yaml");
  task.plant.simulation.support = sim::Support::box;
  task.plant.simulation.dead_time = 0.135;
  task.plant.simulation.motor_lag = 0.005;
  task.plant.simulation.velocity_loop_integral = 1.1;
  task.plant.model = sim::linearModel(task.plant.simulation);
  task.urdf = sim::readText(kPackage + "/sim/urdf/jackal.urdf");
  task.other_speeds = {0.3};
  task.lowest_orders = task.highest_orders = 2;
  task.linear_evaluations = 1500;
  task.evaluations = 12;
  return task;
}

double settling(const GainAssessment& assessment, std::size_t step = 0) {
  return assessment.responses[step].settling.value();
}

TEST(WithOrders, RepeatsTheLastVariance) {
  const ControllerParameters five = withOrders(ControllerParameters{}, 5), none = withOrders(ControllerParameters{}, 0);
  EXPECT_EQ(five.orders, 5);
  EXPECT_EQ(five.state_variances, (std::vector<double>{1.5, 2.0, 4.0, 8.0, 8.0, 8.0}));
  EXPECT_EQ(none.orders, 0);
  EXPECT_EQ(none.sensory_variances, std::vector<double>{2.0});
}

TEST(DampedStart, IsStableForSlowAndFastRobots) {
  GainSearchTask task = smallTask();
  for (const double dead_time : {0.05, 0.135, 0.3}) {
    task.plant.model.dead_time = dead_time;
    for (int orders = 0; orders <= 5; ++orders) {
      const ControllerParameters start = dampedStart(task, orders, 0.2);
      EXPECT_TRUE(isStable(LinearLoop(start, {}, task.plant.model))) << dead_time << " s, orders " << orders;
    }
  }
}

TEST(DampedStart, DampsByTheFirstDerivative) {
  GainSearchTask task = smallTask();
  task.plant.model.velocity_loop_integral = 0.0;  // whose slow mode would hide the others
  const ControllerParameters damped = dampedStart(task, 1, 0.2);
  ControllerParameters vague = damped;
  vague.sensory_variances[1] = 1e6;
  EXPECT_LT(LinearLoop(damped, {}, task.plant.model).spectralRadius(LoopMode::straight),
            LinearLoop(vague, {}, task.plant.model).spectralRadius(LoopMode::straight) - 0.01);
}

TEST(GainCost, RisesWithEveryThingThatIsOutOfBounds) {
  GainSearchTask task = withoutNoise(smallTask());
  ControllerParameters slower = task.start.controller;
  slower.kappa_a = 6.0;
  const GainAssessment assessment = assessGains(task, slower);
  ASSERT_LT(assessment.responses[0].overshoot_pct, 3.0);
  const double cost = gainCost(task, slower, {10.0});
  EXPECT_GT(cost, settling(assessment)) << "the band of the search is narrower";
  EXPECT_LT(cost, settling(assessment) + 0.3);
  EXPECT_NEAR(gainCost(task, slower, {0.1}) - gainCost(task, slower, {0.2}), 0.2, 1e-9) << "slower at another speed";
  EXPECT_LT(gainCost(task, slower, {0.1}, 0.01), gainCost(task, slower, {0.1})) << "gives up before the other speed";
  task.overshoot_pct = assessment.responses[0].overshoot_pct;  // of which the search keeps a reserve
  EXPECT_GT(gainCost(task, slower, {10.0}), cost + 0.1);
}

TEST(GainCost, IsWorseThanAnyResponseWithoutTheMargins) {
  GainSearchTask task = smallTask();
  const Certificate certificate = certify(task.start.controller, {}, task.plant.model);
  task.margins = {certificate.gain_margin + 0.01, 0.05};
  EXPECT_GT(gainCost(task, task.start.controller, {10.0}), 100.0);
  task.margins = {2.0, certificate.delay_margin + 0.001};
  EXPECT_GT(gainCost(task, task.start.controller, {10.0}), 100.0);
  task.margins = {certificate.gain_margin - 0.01, certificate.delay_margin - 0.001};
  EXPECT_LT(gainCost(task, task.start.controller, {10.0}), 100.0);
}

TEST(KeepsBounds, EachBoundCounts) {
  GainSearchTask task = smallTask();
  const GainAssessment assessment = assessGains(task, task.start.controller);
  const double other = settling(assessment, 1);
  task.overshoot_pct = assessment.responses[0].overshoot_pct + 0.1;
  EXPECT_TRUE(keepsBounds(task, assessment, {other}));
  EXPECT_FALSE(keepsBounds(task, assessment, {other - 0.001}));
  GainSearchTask stricter = task;
  stricter.overshoot_pct -= 0.2;
  EXPECT_FALSE(keepsBounds(stricter, assessment, {other}));
  stricter = task;
  stricter.margins.gain = assessment.certificate.gain_margin + 0.01;
  EXPECT_FALSE(keepsBounds(stricter, assessment, {other}));
  stricter = task;
  stricter.margins.delay = assessment.certificate.delay_margin + 0.01;
  EXPECT_FALSE(keepsBounds(stricter, assessment, {other}));
}

TEST(SearchGains, FindsFasterGainsWithinTheBoundsWhateverTheThreads) {
  GainSearchTask task = smallTask();
  task.jobs = 1;
  std::size_t finished = 0, all = 0;
  const auto results = searchGains(task, [&](std::size_t f, std::size_t a) {
    EXPECT_GE(f, finished);
    finished = f;
    all = a;
  });
  EXPECT_EQ(finished, all);
  ASSERT_EQ(results.size(), 1u);
  const GainAssessment& best = results[0].best;
  const GainSearchTask quiet = withoutNoise(task);
  EXPECT_EQ(results[0].orders, 2);
  EXPECT_TRUE(results[0].keeps_bounds);
  EXPECT_TRUE(keepsBounds(quiet, best, slowestAllowed(quiet)));
  EXPECT_LT(settling(best), 0.7 * settling(assessGains(quiet, task.start.controller)));

  task.jobs = 2;
  task.lowest_orders = 1;
  const auto again = searchGains(task);
  ASSERT_EQ(again.size(), 2u);
  EXPECT_EQ(again[1].best.controller.tau, best.controller.tau);
  EXPECT_EQ(again[1].best.controller.state_variances, best.controller.state_variances);
}

/// The preset that ships keeps what it promises on the calibrated robot on its box: without noise at all speeds, with
/// it at the speed that it was tuned for.
TEST(TunedPreset, SettlesAFifthFasterThanImprovedAndKeepsItsMargins) {
  GainSearchTask task = smallTask();
  task.plant = readPlantFile(kPackage + "/config/plant_box.yaml");
  task.other_speeds = {0.1, 0.3, 1.0};
  const ControllerParameters tuned = readControllerFile(kPackage + "/config/tuned.yaml").controller;
  const GainSearchTask quiet = withoutNoise(task);
  const GainAssessment assessment = assessGains(quiet, tuned);
  EXPECT_TRUE(keepsBounds(quiet, assessment, slowestAllowed(quiet)));
  EXPECT_LT(settling(assessment), 0.8 * settling(assessGains(quiet, task.start.controller)));

  task.other_speeds.clear();
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    task.plant.simulation.seed = seed;
    const GainAssessment noisy = assessGains(task, tuned);
    EXPECT_LT(settling(noisy), 0.8 * settling(assessGains(task, task.start.controller))) << "seed " << seed;
    EXPECT_LE(noisy.responses[0].overshoot_pct, 5.0) << "seed " << seed;
  }
}

}  // namespace
}  // namespace jackal_aic
