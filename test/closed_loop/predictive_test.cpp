// The predictive controller at its bars, on the calibrated plants: the runs of experiments.yaml, as the report shows
// them.

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "comparison.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"
#include "parallel.hpp"
#include "plant_conversion.hpp"

namespace jackal_aic::sim {
namespace {

const PackageFiles& files() {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return files;
}

/// The node of an experiment, by fewer controllers.
YAML::Node experiment(const std::string& name, const std::vector<std::string>& controllers) {
  for (const YAML::Node& node : YAML::LoadFile(files().path("sim/experiments/experiments.yaml"))["experiments"]) {
    if (node["name"].as<std::string>() != name) continue;
    YAML::Node chosen = YAML::Clone(node);
    chosen["controllers"] = controllers;
    return chosen;
  }
  throw ParameterError("no experiment " + name);
}

std::vector<ResultRow> rows(const std::vector<Run>& runs) {
  std::vector<ResultRow> rows(runs.size());
  parallelFor(runs.size(), 0, [&](std::size_t i) { rows[i] = runs[i]().row; });
  return rows;
}

std::string nameOf(const ResultRow& row) {
  return row.controller + " on " + row.plant + ", step " + std::to_string(row.step_mps.value_or(0.0)) + " m/s, " +
         std::to_string(row.step_radps.value_or(0.0)) + " rad/s, " + row.label;
}

/// The run of another controller in the same case.
const ResultRow& same(const std::vector<ResultRow>& rows, const ResultRow& row, const std::string& controller) {
  const auto found = std::find_if(rows.begin(), rows.end(), [&](const ResultRow& other) {
    return other.controller == controller && other.plant == row.plant && other.label == row.label &&
           other.step_mps == row.step_mps && other.step_radps == row.step_radps;
  });
  if (found == rows.end()) throw ParameterError("no run of " + controller + " like " + nameOf(row));
  return *found;
}

/// What was asked for.
double bar(const char* name) { return files().bar(name); }

/// The rows of which something holds; there have to be as many as said, lest a test that goes through them shows
/// nothing.
template <class Holds>
std::vector<ResultRow> only(const std::vector<ResultRow>& rows, std::size_t count, const Holds& holds) {
  std::vector<ResultRow> some;
  std::copy_if(rows.begin(), rows.end(), std::back_inserter(some), holds);
  EXPECT_EQ(some.size(), count);
  return some;
}

std::vector<ResultRow> predictiveRows(const std::vector<ResultRow>& rows, std::size_t count) {
  return only(rows, count, [](const ResultRow& row) { return row.controller == "predictive"; });
}

TEST(Predictive, IsAsFastAsOpenLoopAndExact) {
  const auto all = rows(comparisonRuns(files(), experiment("predictive_steps", {"predictive", "diff_drive"})));
  ASSERT_EQ(all.size(), 2u * 2u * 4u);
  for (const ResultRow& row : predictiveRows(all, 2u * 4u)) {
    ASSERT_TRUE(row.bounded && row.settling_s) << nameOf(row);
    EXPECT_LE(*row.settling_s,
              bar("predictive_steps.settling_over_open_loop") * same(all, row, "diff_drive").settling_s.value())
        << nameOf(row);
    EXPECT_LE(*row.overshoot_pct, bar("predictive_steps.overshoot")) << nameOf(row);
    EXPECT_LE(std::abs(*row.steady_error_pct), bar("predictive_steps.steady_error")) << nameOf(row);
    EXPECT_LE(*row.tracking_rms_radps, 0.01) << nameOf(row) << ": does not swerve";
  }
}

TEST(Predictive, IsFarFasterThanImprovedOnTheBox) {
  YAML::Node node = experiment("predictive_steps", {"predictive", "improved"});
  node["plants"] = std::vector<std::string>{"box"};
  const auto all = rows(comparisonRuns(files(), node));
  const auto half = [](const ResultRow& row) { return row.controller == "predictive" && row.step_mps == 0.5; };
  for (const ResultRow& row : only(all, 1, half)) {
    EXPECT_LE(*row.settling_s,
              bar("predictive_steps.settling_over_improved") * same(all, row, "improved").settling_s.value());
  }
}

TEST(Predictive, StaysStableExactAndQuickOnARobotThatIsNotItsModel) {
  const auto all = rows(perturbationRuns(files(), experiment("predictive_perturbations", {"predictive"})));
  ASSERT_EQ(all.size(), 2u * 13u);
  for (const ResultRow& row : all) {
    ASSERT_TRUE(row.bounded && row.settling_s) << nameOf(row);
    EXPECT_LE(*row.settling_s, bar("predictive_perturbations.settling")) << nameOf(row);
    EXPECT_LE(std::abs(*row.steady_error_pct), bar("predictive_perturbations.steady_error")) << nameOf(row);
  }
}

TEST(Predictive, SurvivesTwoHundredPairsOfPerturbations) {
  const auto all = rows(pairRuns(files(), experiment("predictive_pairs", {"predictive"})));
  ASSERT_EQ(all.size(), 2u * 200u);
  for (const char* plant : {"box", "ground"}) {
    int settled = 0;
    for (const ResultRow& row : only(all, 200, [&](const ResultRow& r) { return r.plant == plant; })) {
      EXPECT_TRUE(row.bounded) << nameOf(row);
      settled += row.settling_s.value_or(HUGE_VAL) <= bar("predictive_pairs.settling");
    }
    EXPECT_GE(settled, 200 * bar("predictive_pairs.settled") / 100.0) << plant;
  }
}

// 0.7 x improved, which one would wish for, is out of reach for every controller on this plant: its dead time and its
// acceleration limit alone cost 0.75 to 0.79 x improved. What is left to a controller is how close it comes to that.
TEST(Predictive, TracksSquareWavesAsWellAsThePlantLets) {
  const auto all =
      rows(comparisonRuns(files(), experiment("predictive_squares", {"predictive", "improved", "plant_limit"})));
  for (const ResultRow& row : predictiveRows(all, 6)) {
    const double limit = *same(all, row, "plant_limit").tracking_rms_mps;
    const double improved = *same(all, row, "improved").tracking_rms_mps;
    EXPECT_LE(limit, *row.tracking_rms_mps) << nameOf(row);
    EXPECT_LE(*row.tracking_rms_mps, 1.03 * limit) << nameOf(row);
    EXPECT_LE(*row.tracking_rms_mps, 0.80 * improved) << nameOf(row);
  }
}

TEST(Predictive, LearnsTheSlipOfTheGroundWithinThreeSeconds) {
  const auto all = rows(comparisonRuns(files(), experiment("slip_turns", {"predictive", "standard", "improved"})));
  ASSERT_EQ(all.size(), 3u * 10u);
  for (const ResultRow& row : all) {
    ASSERT_TRUE(row.bounded) << nameOf(row);
    if (row.controller == "predictive") {
      EXPECT_LE(std::abs(*row.steady_error_pct), bar("slip_turns.steady_error")) << nameOf(row);
      EXPECT_LE(std::abs(*row.belief_bias_pct), 2.0) << nameOf(row);
    } else {
      EXPECT_GT(std::abs(*row.steady_error_pct), 4.0) << nameOf(row);
      EXPECT_GT(std::abs(*row.belief_bias_pct), 4.0) << nameOf(row) << ": believes what it wishes";
    }
  }
}

TEST(Predictive, DrivesStraightWhateverItsEffectiveTrack) {
  const auto all = rows(comparisonRuns(files(), experiment("slip_straight", {"predictive"})));
  ASSERT_EQ(all.size(), 3u);
  for (const ResultRow& row : all) {
    EXPECT_NEAR(*row.settling_s, *all.front().settling_s,
                0.01 * bar("slip_straight.settling_spread") * *all.front().settling_s)
        << nameOf(row);
    EXPECT_NEAR(*row.steady_error_pct, *all.front().steady_error_pct, bar("slip_straight.steady_error_spread"))
        << nameOf(row);
  }
}

TEST(Predictive, SettlesTheSameAtEveryBeliefRate) {
  const auto all = rows(comparisonRuns(files(), experiment("predictive_rates", {"predictive"})));
  ASSERT_EQ(all.size(), 2u * 5u);
  for (const char* plant : {"box", "ground"}) {
    double quickest = HUGE_VAL, slowest = 0.0;
    for (const ResultRow& row : only(all, 5, [&](const ResultRow& r) { return r.plant == plant; })) {
      quickest = std::min(quickest, row.settling_s.value());
      slowest = std::max(slowest, row.settling_s.value());
    }
    EXPECT_LE(slowest, (1.0 + 0.01 * bar("predictive_rates.settling_spread")) * quickest) << plant;
  }
}

TEST(Predictive, BelievesTheTruthAsWellAsAKalmanFilter) {
  const auto all = rows(beliefAccuracyRuns(files(), experiment("belief_accuracy", {"predictive", "improved"})));
  ASSERT_EQ(all.size(), 2u * 3u);
  for (const ResultRow& row : predictiveRows(all, 2)) {
    const ResultRow& filter = same(all, row, "kalman_filter");
    const ResultRow& improved = same(all, row, "improved");
    EXPECT_LE(*row.belief_rms_mps, bar("belief_accuracy.error_over_kalman_filter") * *filter.belief_rms_mps)
        << row.plant;
    EXPECT_LE(*row.belief_rms_radps, bar("belief_accuracy.error_over_kalman_filter") * *filter.belief_rms_radps)
        << row.plant;
    EXPECT_LE(*row.belief_rms_mps, 0.1 * *improved.belief_rms_mps) << row.plant;
    EXPECT_LE(*row.belief_rms_radps, 0.1 * *improved.belief_rms_radps) << row.plant;
  }
}

struct Files {
  const char* plant;
  const char* model;
};

class PlantModelFile : public testing::TestWithParam<Files> {};

TEST_P(PlantModelFile, IsThatOfTheSimulatedRobot) {
  ParameterMap map;
  addYamlFile(files().path(GetParam().plant), map);
  addYamlFile(files().path(GetParam().model), map);
  const PlantModel robot = linearModel(readParameters<PlantParameters>(map, "plant"));
  const auto file = readParameters<PlantModel>(map, "plant_model");
  EXPECT_EQ(file.dead_time, robot.dead_time);
  EXPECT_EQ(file.lag, robot.lag);
  EXPECT_EQ(file.gain, robot.gain);
  EXPECT_EQ(file.offset, robot.offset);
  EXPECT_EQ(file.velocity_loop_integral, robot.velocity_loop_integral);
  EXPECT_EQ(file.acceleration_limit, robot.acceleration_limit);
  EXPECT_EQ(file.sensor_rate, robot.sensor_rate);
  EXPECT_EQ(file.on_box, robot.on_box);
}

INSTANTIATE_TEST_SUITE_P(OnGroundAndBox, PlantModelFile,
                         testing::Values(Files{"config/plant.yaml", "config/plant_model.yaml"},
                                         Files{"config/plant_box.yaml", "config/plant_model_box.yaml"}));

}  // namespace
}  // namespace jackal_aic::sim
