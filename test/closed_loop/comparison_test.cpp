// The experiments beyond the thesis: what is drawn, disturbed and measured.

#include "comparison.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "perturbation.hpp"
#include "plant_limit.hpp"

namespace jackal_aic::sim {
namespace {

const PackageFiles& files() {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return files;
}

TEST(Perturbation, PairsDifferWithinTheirBoundsAndRepeat) {
  const auto pairs = drawPairs(200, 1);
  const auto again = drawPairs(200, 1);
  std::set<std::string> kinds;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    EXPECT_NE(pairs[i].first.kind, pairs[i].second.kind);
    for (const auto& drawn : {pairs[i].first, pairs[i].second}) {
      EXPECT_GE(drawn.value, drawn.kind->low);
      EXPECT_LE(drawn.value, drawn.kind->high);
      kinds.insert(drawn.kind->name);
    }
    EXPECT_EQ(pairs[i].label(), again[i].label());
  }
  EXPECT_EQ(kinds.size(), perturbations().size());
  EXPECT_NE(drawPairs(1, 2)[0].label(), pairs[0].label());
}

TEST(Perturbation, ChangesThePlantAndNotTheModel) {
  for (const Perturbation& kind : perturbations()) {
    LoopSetup setup = loadSetup(files(), "predictive", "box", {});
    const PlantParameters before = setup.plant;
    const PlantModel model = *setup.drive.plant_model;
    perturb(setup, {&kind, kind.extremes.front()});
    const PlantParameters& after = setup.plant;
    const bool changed = after.wheel_gain != before.wheel_gain || after.dead_time != before.dead_time ||
                         after.motor_lag != before.motor_lag || after.payload != before.payload ||
                         after.friction != before.friction || after.slope != before.slope ||
                         after.noise_scale != before.noise_scale || after.measurement_loss != before.measurement_loss;
    EXPECT_TRUE(changed) << kind.name;
    const PlantModel& told = *setup.drive.plant_model;
    EXPECT_EQ(told.gain, model.gain) << kind.name;
    EXPECT_EQ(told.dead_time, model.dead_time) << kind.name;
    EXPECT_EQ(told.lag, model.lag) << kind.name;
  }
}

TEST(Perturbation, TellsTheDifferentialDriveTheWheelGain) {
  LoopSetup setup = loadSetup(files(), "diff_drive", "box", {});
  perturb(setup, {&perturbations()[0], 0.8});
  EXPECT_DOUBLE_EQ(std::get<DifferentialDriveParameters>(setup.drive.controller).wheel_gain, 0.8);
  const ResultRow row = runSetup(setup, stepProfile(0.5, 0.0, 4.0)).row;
  EXPECT_NEAR(row.steady_error_pct.value(), 0.0, 0.1);
}

TEST(DrivingCycle, RepeatsItsSeedWithinItsBounds) {
  const SetPointProfile a = cycleProfile({3, 30, 0.8, 0.6}), b = cycleProfile({3, 30, 0.8, 0.6});
  ASSERT_EQ(a.changes.size(), 30u);
  bool backward = false, left = false, right = false;
  for (std::size_t i = 0; i < a.changes.size(); ++i) {
    const SetPoint& set_point = a.changes[i].set_point;
    EXPECT_EQ(set_point.vector(), b.changes[i].set_point.vector());
    EXPECT_LE(std::abs(set_point.forward), 0.8);
    EXPECT_LE(std::abs(set_point.yaw_rate), 0.6);
    backward |= set_point.forward < 0.0;
    left |= set_point.yaw_rate > 0.0;
    right |= set_point.yaw_rate < 0.0;
  }
  EXPECT_TRUE(backward && left && right);
  EXPECT_NE(cycleProfile({4, 30, 0.8, 0.6}).duration, a.duration);
  EXPECT_THROW(cycleProfile({1, 0}), ParameterError);
  EXPECT_THROW(cycleProfile({1, 5, -1.0}), ParameterError);
}

TEST(FrictionChange, ChangesTheArcInMidRun) {
  const auto run = [](const char* profile) {
    const LoopSetup setup = loadSetup(files(), "diff_drive", "ground", {{"plant.noise_scale", "0"}});
    return runSetup(setup, readProfile(YAML::Load(profile))).samples;
  };
  const auto same = run("{forward: 0.5, yaw_rate: 0.5, duration: 3}");
  const auto changed = run("{forward: 0.5, yaw_rate: 0.5, duration: 3, friction_changes: [{time: 2, friction: 0.25}]}");
  EXPECT_EQ(same[1990].yaw_rate, changed[1990].yaw_rate);
  EXPECT_GT(std::abs(changed.back().yaw_rate - same.back().yaw_rate), 0.02);
}

TEST(Profile, RefusesAnUnknownKey) {
  EXPECT_THROW(readProfile(YAML::Load("{forward: 0.5, speeed: 1}")), ParameterError);
}

TEST(PlantLimit, FollowsAfterTheDeadTimeAtTheAccelerationLimit) {
  PlantParameters plant;
  plant.dead_time = 0.1;
  plant.acceleration_limit = 2.0;
  const RunResult run = runPlantLimit("p", plant, stepProfile(0.4, 0.0, 2.0));
  const auto at = [&](double time) { return run.samples[static_cast<std::size_t>(std::lround(time * 1000))].velocity; };
  EXPECT_EQ(at(kRestTime + 0.099), 0.0);
  EXPECT_NEAR(at(kRestTime + 0.2), 0.2, 0.003);
  EXPECT_DOUBLE_EQ(at(kRestTime + 0.31), 0.4);
}

TEST(RunErrors, AreRootMeanSquaresSinceTheFirstStep) {
  std::vector<Sample> samples(2);
  samples[0].time = 0.0;  // at rest: does not count
  samples[0].velocity = 9.0;
  samples[1].time = kRestTime;
  samples[1].set_point = {1.0, 0.0, 0.5};
  samples[1].velocity = 0.6;
  samples[1].yaw_rate = 0.8;
  samples[0].belief = BodyVector::Zero();
  samples[1].belief = BodyVector(0.5, 0.0, 1.0);
  const RunErrors errors = runErrors(samples);
  EXPECT_NEAR(errors.tracking(kForward), 0.4, 1e-12);
  EXPECT_NEAR(errors.tracking(kYaw), 0.3, 1e-12);
  EXPECT_NEAR((*errors.belief)(kForward), 0.1, 1e-12);
  EXPECT_NEAR((*errors.belief)(kYaw), 0.2, 1e-12);
}

TEST(BeliefAccuracy, KalmanFilterSeesTheSameRun) {
  const auto runs = beliefAccuracyRuns(
      files(),
      YAML::Load("{controllers: [predictive], plants: [box], kalman_filter_track: 0.5, profile: {forward: 0.5}}"));
  ASSERT_EQ(runs.size(), 2u);
  const RunResult controller = runs[0](), filter = runs[1]();
  EXPECT_EQ(filter.row.controller, "kalman_filter");
  EXPECT_EQ(controller.row.tracking_rms_mps, filter.row.tracking_rms_mps);
  EXPECT_NE(controller.row.belief_rms_mps, filter.row.belief_rms_mps);
  EXPECT_LT(*filter.row.belief_rms_mps, 0.01);
}

}  // namespace
}  // namespace jackal_aic::sim
