#include "gain_search.hpp"

#include <gtest/gtest.h>

#include "package_files.hpp"

namespace jackal_aic {
namespace {

const std::string kPackage = JACKAL_AIC_SOURCE_DIR;

/// A small search on the robot on its box.
GainSearchTask smallTask() {
  GainSearchTask task;
  task.start = readControllerFile(kPackage + "/config/improved.yaml");
  task.plant = readPlantFile(kPackage + "/config/plant_box.yaml");
  task.urdf = sim::readText(kPackage + "/sim/urdf/jackal.urdf");
  task.other_speeds = {0.3};
  task.lowest_orders = task.highest_orders = 1;
  task.evaluations = 30;
  task.random_starts = 0;
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
  for (const double dead_time : {0.05, 0.135, 0.3}) {
    PlantModel plant;
    plant.dead_time = dead_time;
    for (int orders = 0; orders <= 5; ++orders) {
      const ControllerParameters start = dampedStart(ControllerParameters{}, plant, orders);
      EXPECT_TRUE(isStable(LinearLoop(start, {}, plant))) << dead_time << " s, orders " << orders;
    }
  }
}

TEST(DampedStart, DampsByTheFirstDerivative) {
  const PlantModel plant;
  const ControllerParameters damped = dampedStart(ControllerParameters{}, plant, 1);
  ControllerParameters vague = damped;
  vague.sensory_variances[1] = 1e6;
  EXPECT_LT(LinearLoop(damped, {}, plant).spectralRadius(LoopMode::straight),
            LinearLoop(vague, {}, plant).spectralRadius(LoopMode::straight) - 0.01);
}

TEST(GainCost, IsTheSettlingTimeWithinTheBounds) {
  GainSearchTask task = smallTask();
  ControllerParameters slower = task.start.controller;
  slower.kappa_a = 6.0;
  const GainAssessment assessment = assessGains(task, slower);
  ASSERT_LT(assessment.responses[0].overshoot_pct, 4.0);
  EXPECT_NEAR(gainCost(task, slower, {10.0}), settling(assessment), 0.02);
  EXPECT_NEAR(gainCost(task, slower, {settling(assessment, 1) - 0.1}) - gainCost(task, slower, {10.0}), 0.2, 1e-9)
      << "slower at another speed";
  task.overshoot_pct = assessment.responses[0].overshoot_pct;  // of which the search keeps one percent in reserve
  EXPECT_GT(gainCost(task, slower, {10.0}), settling(assessment) + 0.1);
}

TEST(GainCost, IsWorseThanAnyResponseWithoutTheMargins) {
  GainSearchTask task = smallTask();
  task.margins = {3.0, 0.05};  // improved has a gain margin of 2.85
  EXPECT_GT(gainCost(task, task.start.controller, {10.0}), 100.0);
  task.margins = {2.0, 0.26};  // and a delay margin of 0.25 s
  EXPECT_GT(gainCost(task, task.start.controller, {10.0}), 100.0);
}

TEST(KeepsBounds, EachBoundCounts) {
  GainSearchTask task = smallTask();
  task.overshoot_pct = 10.0;
  const GainAssessment assessment = assessGains(task, task.start.controller);
  const double other = settling(assessment, 1);
  EXPECT_TRUE(keepsBounds(task, assessment, {other}));
  EXPECT_FALSE(keepsBounds(task, assessment, {other - 0.001}));
  GainSearchTask stricter = task;
  stricter.overshoot_pct = 5.0;
  EXPECT_FALSE(keepsBounds(stricter, assessment, {other}));
  stricter = task;
  stricter.margins.gain = 3.0;
  EXPECT_FALSE(keepsBounds(stricter, assessment, {other}));
  stricter = task;
  stricter.margins.delay = 0.3;
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
  ASSERT_TRUE(results[0].best);
  EXPECT_EQ(results[0].orders, 1);
  EXPECT_TRUE(keepsBounds(task, *results[0].best, slowestAllowed(task)));
  EXPECT_LT(settling(*results[0].best), 0.8 * settling(assessGains(task, task.start.controller)));

  task.jobs = 2;
  const auto again = searchGains(task);
  EXPECT_EQ(again[0].best->controller.tau, results[0].best->controller.tau);
  EXPECT_EQ(again[0].best->controller.state_variances, results[0].best->controller.state_variances);
}

/// The preset that ships keeps what it promises.
TEST(TunedPreset, SettlesAFifthFasterThanImprovedAndKeepsItsMargins) {
  GainSearchTask task = smallTask();
  task.other_speeds = {0.1, 0.3, 1.0};
  for (const std::uint64_t seed : {1, 2, 3}) {
    task.plant.simulation.seed = seed;
    const GainAssessment improved = assessGains(task, task.start.controller);
    const GainAssessment tuned = assessGains(task, readControllerFile(kPackage + "/config/tuned.yaml").controller);
    EXPECT_LT(settling(tuned), 0.8 * settling(improved)) << "seed " << seed;
    EXPECT_LE(tuned.responses[0].overshoot_pct, 5.0) << "seed " << seed;
    for (std::size_t i = 1; i < 4; ++i) EXPECT_LE(settling(tuned, i), settling(improved, i)) << tuned.speeds[i];
    EXPECT_GE(tuned.certificate.gain_margin, 2.0);
    EXPECT_GE(tuned.certificate.delay_margin, 0.05);
  }
}

}  // namespace
}  // namespace jackal_aic
