// Model predictive control on the drive train that is its model.

#include "model_predictive.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace jackal_aic::sim {
namespace {

constexpr double kRadius = 0.098;
constexpr int kSteps = 20;  // in an action period

PlantModel model() {
  PlantModel m;
  m.dead_time = 0.08;
  m.lag = 0.03;
  m.velocity_loop_integral = 1.0;
  m.acceleration_limit = 1.65;
  return m;
}

/// Wheel speed at the end of each action period after a step from rest. @param disturbance of the motors' input
/// [rad/s].
std::vector<double> driven(const MpcTuning& tuning, double wanted, int periods, double disturbance = 0.0) {
  ModelPredictive controller(model(), kRadius, tuning);
  const DriveTrain wheel(model(), kRadius);
  CommandsUnderWay commands(model().dead_time);
  Eigen::Vector3d x(0.0, 0.0, disturbance);
  controller.reset(0.0);
  std::vector<double> speeds;
  for (int k = 0; k < periods; ++k) {
    controller.correct(x(0));
    controller.act(wanted);
    for (int i = 0; i < kSteps; ++i) {
      wheel.step(x, commands.step(controller.command()));
      controller.predict();
    }
    speeds.push_back(x(0));
  }
  return speeds;
}

TEST(ModelPredictive, ArrivesAsSoonAsTheLimitAllowsAndNotBeyond) {
  // 5 rad/s at 16.8 rad/s^2 take 0.297 s after the dead time: 19 periods in all. One more is lost because the limit
  // holds within the periods, too, where the lag does not let the speed rise evenly.
  const auto speeds = driven({{}, 1e-3}, 5.0, 30);
  EXPECT_LT(speeds[17], 4.9);
  EXPECT_NEAR(speeds[19], 5.0, 0.05);
  EXPECT_LT(*std::max_element(speeds.begin(), speeds.end()), 5.05);
}

TEST(ModelPredictive, IsOptimalWithoutALimitWhereNoneIsMet) {
  // Twice the step, twice the answer: the constraints are not active, and what is left is linear.
  const auto one = driven({{}, 0.5}, 0.02, 30), two = driven({{}, 0.5}, 0.04, 30);
  for (std::size_t k = 0; k < one.size(); ++k) EXPECT_NEAR(two[k], 2.0 * one[k], 1e-12) << k;
  EXPECT_NEAR(one.back(), 0.02, 1e-4);
}

TEST(ModelPredictive, HasNoSteadyStateErrorUnderADisturbance) {
  EXPECT_NEAR(driven({{}, 0.5}, 5.0, 300, -1.0).back(), 5.0, 1e-3);
}

}  // namespace
}  // namespace jackal_aic::sim
