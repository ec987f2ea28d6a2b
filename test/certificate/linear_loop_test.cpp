#include "jackal_aic/certificate/linear_loop.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "../complaint.hpp"
#include "ground.hpp"
#include "jackal_aic/aic/spectral_radius.hpp"
#include "jackal_aic/certificate/jitter_search.hpp"

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

TEST(LinearLoop, IntegratorWithDeadTimeIsStableUpToTheKnownGain) {
  // z^(n+1) - z^n + c = 0 has its roots inside the unit circle for 0 < c < 2 sin(pi / (2 (2n + 1)))
  for (int n = 0; n <= 8; ++n) {
    const double limit = 2.0 * std::sin(kPi / (2.0 * (2 * n + 1)));
    EXPECT_LT(radiusWithGain(0.999 * limit, 0.02 * n), 1.0) << n;
    EXPECT_GT(radiusWithGain(1.001 * limit, 0.02 * n), 1.0) << n;
  }
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
  expectSays(complaint([&] { LinearLoop(ControllerParameters{}, {}, plant); }), {"plant_model.sensor_rate = 49.7 Hz"});
}

using Eigen::MatrixXd;

LinearLoop groundLoop() { return {PredictiveParameters{}, ground(), ground()}; }

TEST(JitteredMap, IsThePeriodMapWithoutJitter) {
  const LinearLoop loop = groundLoop();
  const Eigen::Vector3d regular = loop.irregularGains(1)[1];
  for (const double phase : {0.0, 0.0055, 0.02}) {
    for (const double extra : {0.0, 0.013}) {
      const MatrixXd map = loop.jitteredMap({phase, extra, regular}, 0.04);
      EXPECT_NEAR(spectralRadiusOf(map).value, loop.spectralRadius(LoopMode::straight, {1.0, extra, phase}), 1e-6)
          << phase << ", " << extra;
    }
  }
}

TEST(JitterSearch, FindsNoGrowthOnASlightlyIrregularClock) {
  for (const Jitter& jitter : {Jitter{0.02, 0}, Jitter{0.0, 3}}) {
    EXPECT_LT(worstGrowth(groundLoop(), jitter), 1.0) << jitter.extra_delay << " s, " << jitter.lost_samples << " lost";
  }
}

TEST(JitterSearch, FindsGrowthInASequenceOfStablePeriods) {
  const LinearLoop loop = groundLoop();
  for (const double delay : {0.0, 0.02, 0.04}) EXPECT_TRUE(loop.stable({1.0, delay})) << delay;
  EXPECT_GT(worstGrowth(loop, {0.04, 0}), 1.0);
}

}  // namespace
}  // namespace jackal_aic
