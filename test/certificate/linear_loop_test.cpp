#include "jackal_aic/certificate/linear_loop.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Gains that leave a plain integrator: a belief of order 0 that is tied to the set point, so that a' = -kappa_a Pi_y
/// w.
ControllerParameters integrator(double action_rate = 50.0) {
  ControllerParameters controller;
  controller.belief_rate = controller.action_rate = action_rate;
  controller.orders = 0;
  controller.kappa_mu = 1e-5;
  controller.tau = 1e-5;
  controller.kappa_a = 8.0;
  return controller;
}

/// A wheel that follows its command at once, after the dead time.
PlantModel pureDelay(double dead_time) {
  PlantModel plant;
  plant.dead_time = dead_time;
  plant.lag = 0.0;
  return plant;
}

/// Change of the action in one step per wheel speed.
double stepGain(const ControllerParameters& controller) {
  return controller.actionStep() * controller.kappa_a / controller.sensory_variances[0];
}

double radiusWithGain(double step_gain, double dead_time) {
  ControllerParameters controller = integrator();
  controller.kappa_a *= step_gain / stepGain(controller);
  return LinearLoop(controller, {}, pureDelay(dead_time)).spectralRadius(LoopMode::straight);
}

TEST(LinearLoop, IntegratorWithoutDeadTimeIsAGeometricSequence) {
  // a_k = a_(k-1) - c a_(k-1)
  EXPECT_NEAR(LinearLoop(integrator(), {}, pureDelay(0.0)).spectralRadius(LoopMode::straight, {7.0, 0.0}),
              std::abs(1.0 - 7.0 * stepGain(integrator())), 1e-7);
}

TEST(LinearLoop, IntegratorWithDeadTimeIsStableUpToTheKnownGain) {
  // z^(n+1) - z^n + c = 0 has its roots inside the unit circle for 0 < c < 2 sin(pi / (2 (2n + 1)))
  for (int n = 0; n <= 8; ++n) {
    const double limit = 2.0 * std::sin(kPi / (2.0 * (2 * n + 1)));
    EXPECT_LT(radiusWithGain(0.999 * limit, 0.02 * n), 1.0) << n;
    EXPECT_GT(radiusWithGain(1.001 * limit, 0.02 * n), 1.0) << n;
  }
}

TEST(LinearLoop, DeadTimeOfAFractionIsNotSeenByAWheelThatFollowsAtOnce) {
  // At the sample the command has arrived, for any part of the action period.
  EXPECT_NEAR(radiusWithGain(0.5, 0.031), radiusWithGain(0.5, 0.02), 1e-12);
  EXPECT_GT(std::abs(radiusWithGain(0.5, 0.04) - radiusWithGain(0.5, 0.02)), 1e-3);
}

TEST(LinearLoop, FractionalDeadTimeSplitsTheActionPeriodBetweenTwoCommands) {
  PlantModel plant = pureDelay(0.027);  // one period and 7 ms
  plant.lag = 0.03;
  plant.gain = 0.9;
  const double h = 0.02, f = 0.007;
  const double c = stepGain(integrator());
  const double decay = std::exp(-h / plant.lag), late = std::exp(-(h - f) / plant.lag);
  // State (w_k, a_k, a_(k-1), a_(k-2)); until f the older command acts.
  Eigen::Matrix4d expected;
  expected.row(0) << decay, 0.0, plant.gain * (1.0 - late), plant.gain * (late - decay);
  expected.row(1) << -c * expected.row(0);
  expected(1, 1) += 1.0;
  expected.row(2) << 0.0, 1.0, 0.0, 0.0;
  expected.row(3) << 0.0, 0.0, 1.0, 0.0;
  EXPECT_NEAR(LinearLoop(integrator(), {}, plant).spectralRadius(LoopMode::straight),
              expected.eigenvalues().cwiseAbs().maxCoeff(), 1e-7);
}

TEST(LinearLoop, ChangesOfDeadTimeAndGainEqualThoseOfPlantAndController) {
  const LinearLoop loop(ControllerParameters{}, {}, PlantModel{});
  PlantModel slower;
  slower.dead_time += 0.0537;
  EXPECT_DOUBLE_EQ(loop.spectralRadius(LoopMode::turn, {1.0, 0.0537}),
                   LinearLoop(ControllerParameters{}, {}, slower).spectralRadius(LoopMode::turn));
  ControllerParameters stronger;
  stronger.kappa_a *= 1.7;
  EXPECT_NEAR(loop.spectralRadius(LoopMode::straight, {1.7, 0.0}),
              LinearLoop(stronger, {}, {}).spectralRadius(LoopMode::straight), 1e-12);
}

TEST(LinearLoop, PeriodIsCommonToSensorAndAction) {
  PlantModel plant;
  for (const auto& [rate, period] : {std::pair(20.0, 0.1), std::pair(100.0, 0.02)}) {
    plant.sensor_rate = rate;
    EXPECT_DOUBLE_EQ(LinearLoop(ControllerParameters{}, {}, plant).period(), period);
  }
  plant.sensor_rate = 49.7;
  try {
    const LinearLoop loop(ControllerParameters{}, {}, plant);
    FAIL() << "accepted";
  } catch (const ParameterError& error) {
    EXPECT_NE(std::string(error.what()).find("plant_model.sensor_rate = 49.7 Hz"), std::string::npos) << error.what();
  }
}

TEST(LinearLoop, GyroMattersToTheTurnAlone) {
  ControllerParameters controller;
  controller.kappa_a = 30.0;
  PlantModel ground, box;
  box.on_box = true;
  const LinearLoop with(controller, {}, ground), without(controller, {}, box);
  EXPECT_DOUBLE_EQ(with.spectralRadius(LoopMode::straight), without.spectralRadius(LoopMode::straight));
  EXPECT_GT(with.spectralRadius(LoopMode::turn), without.spectralRadius(LoopMode::turn) + 1e-4)
      << "the gyro adds to the loop gain";
}

TEST(LinearLoop, AWiderTrackTurnsLess) {
  ControllerParameters controller;
  controller.kappa_a = 30.0;
  PlantModel narrow, own, wide, box;
  narrow.effective_track = 0.2;
  own.effective_track = GeometryParameters{}.effective_track;
  wide.effective_track = 5.0;
  box.on_box = true;
  const auto turn = [&](const PlantModel& plant) {
    return LinearLoop(controller, {}, plant).spectralRadius(LoopMode::turn);
  };
  EXPECT_DOUBLE_EQ(turn(own), turn(PlantModel{}));
  EXPECT_GT(turn(narrow), turn(own));
  EXPECT_GT(turn(own), turn(wide));
  EXPECT_NEAR(turn(wide), turn(box), 3e-3);
}

TEST(LinearLoop, DivergingBeliefHasItsRadiusReported) {
  ControllerParameters controller;
  controller.integrator = Integrator::euler;
  controller.tau = 0.005;
  const LinearLoop loop(controller, {}, {});
  EXPECT_NEAR(loop.beliefSpectralRadius(), 4.35, 0.05);  // h kappa_mu Pi_mu / tau^2 = 5.3
  EXPECT_FALSE(loop.stable());
}

TEST(LinearLoop, StepResponseOfAnIntegratorWithDeadTime) {
  // a_k = a_(k-1) + c (1 - a_(k-2)), which the wheel shows one action period later
  const double c = stepGain(integrator());
  const Eigen::VectorXd response = LinearLoop(integrator(), {}, pureDelay(0.02)).stepResponse(6);
  double action[7] = {0.0};
  for (int k = 1; k < 7; ++k) action[k] = action[k - 1] + c * (1.0 - (k >= 3 ? action[k - 2] : 0.0));
  EXPECT_NEAR(response(0), 0.0, 1e-6);
  for (int k = 1; k < 6; ++k) EXPECT_NEAR(response(k), k >= 2 ? action[k - 1] : 0.0, 1e-6) << k;
}

TEST(LinearLoop, VelocityLoopIntegralSlowsTheWheelsDown) {
  // lag s^2 + s + k = 0: with k = 1 and a lag of 0.05 s the slow pole is at -1.056; the loop keeps it where kappa_a is
  // small
  ControllerParameters controller = integrator();
  controller.kappa_a = 1e-6;
  PlantModel plant = pureDelay(0.0);
  plant.lag = 0.05;
  plant.velocity_loop_integral = 1.0;
  const auto eigenvalues = LinearLoop(controller, {}, plant).periodMap(LoopMode::straight).eigenvalues().eval();
  const double slow = std::exp(0.02 * (-1.0 + std::sqrt(1.0 - 0.2)) / 0.1);
  EXPECT_LT((eigenvalues.array() - slow).abs().minCoeff(), 1e-7);
}

}  // namespace
}  // namespace jackal_aic
