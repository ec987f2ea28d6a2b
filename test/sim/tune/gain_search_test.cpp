#include "gain_search.hpp"

#include <gtest/gtest.h>

#include "jackal_aic/config/text_file.hpp"
#include "package_files.hpp"

namespace jackal_aic {
namespace {

const std::string kPackage = JACKAL_AIC_SOURCE_DIR;

ControllerParameters gainsOf(const ControllerFile& file) { return std::get<ControllerParameters>(file.controller); }

GainSearchTask taskOn(const std::vector<std::string>& plants) {
  GainSearchTask task;
  task.start = readControllerFile(kPackage + "/config/improved.yaml");
  for (const std::string& plant : plants) {
    task.robots.push_back({plant, readPlantFile(kPackage + "/config/" + plant + ".yaml")});
  }
  task.urdf = readText(kPackage + "/sim/urdf/jackal.urdf");
  return task;
}

/// A small search on the box.
GainSearchTask smallTask() {
  GainSearchTask task = taskOn({"plant_box"});
  task.lowest_orders = task.highest_orders = 1;
  task.linear_evaluations = 600;
  task.evaluations = 6;
  task.draws = 5;
  return task;
}

TEST(WithOrders, RepeatsTheLastVariance) {
  const ControllerParameters five = withOrders(ControllerParameters{}, 5), none = withOrders(ControllerParameters{}, 0);
  EXPECT_EQ(five.orders, 5);
  EXPECT_EQ(five.state_variances, (std::vector<double>{1.5, 2.0, 4.0, 8.0, 8.0, 8.0}));
  EXPECT_EQ(none.orders, 0);
  EXPECT_EQ(none.sensory_variances, std::vector<double>{2.0});
}

TEST(Starts, AreStableForSlowAndFastRobots) {
  GainSearchTask task = smallTask();
  for (const double dead_time : {0.05, 0.135, 0.3}) {
    task.robots[0].plant.model.dead_time = dead_time;
    for (int orders = 0; orders <= 5; orders += 5) {
      for (const ControllerParameters& start : {dampedStart(task, orders, 0.2), shapedStart(task, orders)}) {
        EXPECT_TRUE(LinearLoop(start, {}, task.robots[0].plant.model).stable()) << dead_time << " s, orders " << orders;
      }
    }
  }
}

TEST(LowestSensoryVariance, GrowsWithTheNoiseOfDifferences) {
  EXPECT_DOUBLE_EQ(lowestSensoryVariance(1, 2.0, 50.0), 1e-5 * 2.0 * 2.0 * 2500.0);
  EXPECT_DOUBLE_EQ(lowestSensoryVariance(2, 2.0, 50.0), 1e-5 * 2.0 * 6.0 * 2500.0 * 2500.0);
}

TEST(LinearCost, IsTheSettlingTimeAtTheWorseEndOfThePhase) {
  const GainSearchTask task = smallTask();
  const LinearLoop loop(gainsOf(task.start), {}, task.robots[0].plant.model);
  double latest = 0.0;
  for (const double phase : {0.0, 0.02}) {
    const Eigen::VectorXd response = loop.stepResponse(120, {1.0, 0.0, phase});
    for (int k = 0; k < 120; ++k) {
      if (std::abs(response(k) - 1.0) > kSearchBand) latest = std::max(latest, 0.02 * (k + 1));
    }
  }
  EXPECT_GT(linearCost(task, gainsOf(task.start)), latest);
  ControllerParameters thin = gainsOf(task.start);
  thin.kappa_a *= 2.0;
  EXPECT_GT(linearCost(task, thin), 100.0) << "without the margins";
}

TEST(GainCost, RisesWithEveryTrialThatIsNotPassedAndGivesUp) {
  GainSearchTask task = smallTask();
  const auto trials = firstTrials(task);
  const double cost = gainCost(task, gainsOf(task.start), trials);
  EXPECT_GT(cost, 0.6) << "settling at the worse end of the phase";
  EXPECT_LT(gainCost(task, gainsOf(task.start), trials, 0.1), cost);
  task.overshoot_pct = 3.0;
  EXPECT_GT(gainCost(task, gainsOf(task.start), firstTrials(task)), cost + 1.0);
  task.margins.gain = 5.0;
  EXPECT_GT(gainCost(task, gainsOf(task.start), trials), 100.0);
}

TEST(AssessGains, NamesWhatIsMissed) {
  GainSearchTask task = smallTask();
  task.margins.gain = 5.0;
  task.overshoot_pct = 3.0;
  const GainAssessment assessment = assessGains(task, gainsOf(task.start), 1);
  ASSERT_GT(assessment.missed.size(), 1U) << "improved overshoots on the box, late in the phase";
  EXPECT_EQ(assessment.missed[0], "plant_box: margins");
  EXPECT_NE(assessment.missed[1].find("plant_box, "), std::string::npos) << assessment.missed[1];
  EXPECT_GT(assessment.settling(), assessment.robots[0].settling_first + 0.05) << "over the phase";
}

TEST(SearchGains, FindsFasterGainsThatPassWhateverTheThreads) {
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
  EXPECT_EQ(results[0].name, "orders 1");
  EXPECT_TRUE(best.missed.empty()) << best.missed.front();
  EXPECT_LT(best.settling(), 0.7) << "improved takes 0.84 s at the worse end of the phase";

  task.jobs = 2;
  const auto again = searchGains(task);
  const auto first = std::get<ControllerParameters>(best.controller);
  const auto second = std::get<ControllerParameters>(again[0].best.controller);
  EXPECT_EQ(second.tau, first.tau);
  EXPECT_EQ(second.state_variances, first.state_variances);
}

TEST(SearchGains, FindsPredictiveGainsThatPass) {
  GainSearchTask task = taskOn({"plant"});
  task.start = readControllerFile(kPackage + "/config/predictive.yaml");
  std::get<PredictiveParameters>(task.start.controller).reference_time = 0.5;
  task.evaluations = 8;
  task.draws = 4;
  const auto results = searchGains(task);
  ASSERT_EQ(results.size(), 1U);
  const GainAssessment &best = results[0].best, start = assessGains(task, task.start.controller, 2);
  EXPECT_FALSE(start.missed.empty()) << "it approaches too slowly";
  EXPECT_TRUE(best.missed.empty()) << best.missed.front();
  EXPECT_LE(best.settling(), start.settling());
}

TEST(MarginViolation, IsOfTheWorstCornerOfTheConfidenceBox) {
  for (const char* preset : {"improved", "predictive"}) {
    GainSearchTask task = taskOn({"plant"});
    task.start = readControllerFile(kPackage + "/config/" + preset + ".yaml");
    const double of_model = marginViolation(task, task.start.controller);
    EXPECT_LT(of_model, 0.0) << preset;
    PlantModel& model = task.robots[0].plant.model;
    model.gain_half_width = 0.1;
    EXPECT_GT(marginViolation(task, task.start.controller), of_model) << preset;
    model.gain_half_width = 2.0;
    EXPECT_GT(marginViolation(task, task.start.controller), 0.0) << preset;
    EXPECT_EQ(assessGains(task, task.start.controller, 2).missed.front(), "plant: margins") << preset;
  }
}

TEST(BoxTrials, DriveTheRobotAtTheCornersOfItsConfidenceBox) {
  PlantFile plant = readPlantFile(kPackage + "/config/plant_model.yaml");
  EXPECT_TRUE(boxTrials(plant, "robot", 10.0).empty());
  plant.model.dead_time_half_width = 0.02;
  const std::vector<Trial> trials = boxTrials(plant, "robot", 10.0);
  ASSERT_EQ(trials.size(), 6U);
  EXPECT_NEAR(trials.front().plant.dead_time, plant.simulation.dead_time - 0.02, 1e-12);
  EXPECT_NEAR(trials.back().plant.dead_time, plant.simulation.dead_time + 0.02, 1e-12);
  EXPECT_EQ(trials.back().bars.overshoot_pct, 15.0) << "a robot that is not its model";
}

/// The preset that ships keeps what its header promises on both simulated robots.
TEST(TunedPreset, PassesWhatUsersDriveOnGroundAndBox) {
  GainSearchTask task = taskOn({"plant", "plant_box"});
  task.draws = 40;
  const Gains tuned = readControllerFile(kPackage + "/config/tuned.yaml").controller;
  const GainAssessment assessment = assessGains(task, tuned, 1);
  for (const std::string& missed : assessment.missed) ADD_FAILURE() << missed;
  EXPECT_LT(assessment.robots[1].settling_last, 0.7) << "on the box, where improved takes 0.84 s";
}

}  // namespace
}  // namespace jackal_aic
