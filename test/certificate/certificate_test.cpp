#include "jackal_aic/certificate/certificate.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include "../complaint.hpp"
#include "jackal_aic/aic/spectral_radius.hpp"
#include "jackal_aic/certificate/jitter_search.hpp"
#include "jackal_aic/certificate/linear_loop.hpp"

namespace jackal_aic {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// The drive train of config/plant_model.yaml.
PlantModel ground(double dead_time = 0.08, double gain = 1.0) { return {dead_time, 0.00636, gain, 0.0, 0.678}; }

ControllerParameters improved(double kappa_a = ControllerParameters{}.kappa_a) {
  ControllerParameters controller;
  controller.belief_rate = 1000.0;
  controller.tau = 0.001;
  controller.kappa_mu = 0.1;
  controller.kappa_a = kappa_a;
  return controller;
}

/// Gains that leave an integrator: a belief of order 0, tied to the set point, so that a' = -kappa_a Pi_y w.
ControllerParameters integrator() {
  ControllerParameters controller;
  controller.belief_rate = controller.action_rate = 50.0;
  controller.orders = 0;
  controller.kappa_mu = 1e-5;
  controller.tau = 1e-5;
  controller.kappa_a = 8.0;
  return controller;
}

/// A wheel that follows its command at once, after the dead time.
PlantModel pureDelay(double dead_time) { return {dead_time, 0.0}; }

/// Change of the action in one step per wheel speed.
double stepGain(const ControllerParameters& controller) {
  return controller.actionStep() * controller.kappa_a / controller.sensory_variances[0];
}

TEST(Certificate, GainMarginOfAnIntegratorWithDeadTime) {
  // z^(m+1) - z^m + c = 0 has its roots inside the unit circle for 0 < c < 2 sin(pi / (2 (2m + 1))), where m = n + 1:
  // an older measurement adds a period to the dead time.
  for (int n = 0; n <= 8; ++n) {
    const double limit = 2.0 * std::sin(kPi / (2.0 * (2 * n + 3)));
    const Certificate certificate = certify(integrator(), {}, pureDelay(0.02 * n));
    EXPECT_NEAR(certificate.straight.gain_margin * stepGain(integrator()) / limit, 1.0, 1e-3) << n;
    // The step gain of 0.08 is below the limit up to m = 19 and above it from m = 20.
    EXPECT_NEAR(certificate.straight.delay_margin, 0.38 - 0.02 * n, 1e-4) << n;
  }
}

TEST(Certificate, MarginsAreWhereTheRadiusIsOne) {
  for (const double kappa_a : {4.0, 8.0, 22.0, 25.0, 40.0}) {
    SCOPED_TRACE(kappa_a);
    const LinearLoop loop(improved(kappa_a), {}, {});
    const Certificate certificate = certify(improved(kappa_a), {}, {});
    for (const auto& [mode, margins] :
         {std::pair(LoopMode::straight, certificate.straight), std::pair(LoopMode::turn, certificate.turn)}) {
      EXPECT_NEAR(loop.worstSpectralRadius(mode, {margins.gain_margin, 0.0}), 1.0, 1e-4);
      EXPECT_NEAR(loop.worstSpectralRadius(mode, {1.0, margins.delay_margin}), 1.0, 1e-4);
      if (kappa_a > 22.0) continue;  // it is sharp
      EXPECT_TRUE(loop.stable(mode, {margins.gain_margin, 0.0}));
      EXPECT_FALSE(loop.stable(mode, {1.00001 * margins.gain_margin, 0.0}));
      EXPECT_TRUE(loop.stable(mode, {1.0, margins.delay_margin}));
      EXPECT_FALSE(loop.stable(mode, {1.0, 1.00001 * margins.delay_margin}));
      EXPECT_EQ(margins.gain_reduction, 0.0);
    }
    EXPECT_EQ(certificate.gain_margin, std::min(certificate.straight.gain_margin, certificate.turn.gain_margin));
    EXPECT_EQ(certificate.delay_margin, std::min(certificate.straight.delay_margin, certificate.turn.delay_margin));
  }
}

TEST(Certificate, UnstableGainsHaveMarginsThatSayHowFarToGoBack) {
  const Certificate certificate = certify(improved(40.0), {}, {});
  EXPECT_FALSE(certificate.stable());
  EXPECT_GT(certificate.spectral_radius, 1.0);
  EXPECT_LT(certificate.gain_margin, 1.0);
  EXPECT_LT(certificate.delay_margin, 0.0);
  EXPECT_EQ(certificate.delay_reduction, 0.0);
  EXPECT_TRUE(certify(improved(0.99 * 40.0 * certificate.gain_margin), {}, {}).stable());
  PlantModel faster;
  faster.dead_time += certificate.delay_margin - 0.001;
  EXPECT_TRUE(certify(improved(40.0), {}, faster).stable());
}

TEST(RequireStable, NamesTheReasonAndTheRemedyInOneLine) {
  ControllerParameters euler = improved();
  euler.integrator = Integrator::euler;
  PredictiveParameters idle;
  idle.action_learning_rate = 0.0;
  const PlantModel known{0.083, 0.008};
  const std::tuple<LinearLoop, std::vector<std::string>> rows[] = {
      {{improved(40.0), {}, known},
       {"controller: the closed loop diverges: spectral radius 1.055", "kappa_a = 40 is too large: stable below 26.4"}},
      {{improved(0.0), {}, known}, {"kappa_a = 0 never corrects the action: raise it"}},
      {{euler, {}, known},
       {"the belief update diverges: spectral radius 65.68", "use integrator: exact, or raise tau"}},
      {{PredictiveParameters{}, ground(), ground(0.4)},
       {"spectral radius", "plant_model.dead_time = 0.4 s", "stable with a dead time below 0.2"}},
      {{idle, ground(), ground()}, {"predictive.action_learning_rate = 0 never corrects"}}};
  for (const auto& [loop, parts] : rows) {
    const std::string line = complaint([loop = loop] { requireStable(loop); });
    for (const std::string& part : parts) expectSays(line, {part});
    EXPECT_FALSE(certify(loop).stable());
  }
  for (const LinearLoop& stable : {LinearLoop(improved(), {}, known), LinearLoop(ControllerParameters{}, {}, {}),
                                   LinearLoop(PredictiveParameters{}, ground(), ground())}) {
    EXPECT_NO_THROW(requireStable(stable));
  }
  PlantModel odd = ground();
  odd.sensor_rate = 49.3;
  EXPECT_THROW(certify(PredictiveParameters{}, ground(), odd), ParameterError);
}

TEST(Advice, DistinguishesStableThinAndUnstable) {
  ControllerParameters slow = improved(0.01);
  slow.action_rate = 500;
  const std::pair<LinearLoop, const char*> rows[] = {
      {{improved(8.0), {}, {}}, "Stable with room"},
      {{improved(22.0), {}, {}}, "Stable, but with a thin margin"},
      {{improved(40.0), {}, {}}, "Unstable"},
      {{PredictiveParameters{}, ground(), ground()}, "Stable with room"},
      {{PredictiveParameters{}, ground(), ground(0.08, 2.0)}, "Stable, but with a thin margin"},
      {{PredictiveParameters{}, ground(), ground(0.4)}, "Unstable"},
      {{slow, {}, {}}, "the dead time by more than 0.5 s"}};  // where the search ended
  for (const auto& [loop, part] : rows) expectSays(advice(certify(loop), loop), {part});
}

TEST(LinearLoop, FractionalDeadTimeSplitsTheActionPeriodBetweenTwoCommands) {
  const PlantModel plant{0.027, 0.03, 0.9};  // one period and 7 ms
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

TEST(LinearLoop, PeriodIsCommonToSensorAndAction) {
  PlantModel plant;
  for (const auto& [rate, period] : {std::pair(20.0, 0.1), std::pair(100.0, 0.02)}) {
    plant.sensor_rate = rate;
    EXPECT_DOUBLE_EQ(LinearLoop(ControllerParameters{}, {}, plant).period(), period);
  }
  plant.sensor_rate = 49.7;
  expectSays(complaint([&] { LinearLoop(ControllerParameters{}, {}, plant); }), {"plant_model.sensor_rate = 49.7 Hz"});
}

LinearLoop groundLoop() { return {PredictiveParameters{}, ground(), ground()}; }

TEST(LoopClock, SensorComesFirstAndActionLastAtEqualTimes) {
  constexpr std::int64_t kMs = 1000000;
  const LoopClock clock{20 * kMs, 2, 1, 4, 8};  // belief at 100 Hz, inner steps of 5 ms, sensor at 25 Hz
  const auto events = clock.events(0, 0);
  ASSERT_EQ(events.size(), 15u);
  const LoopEvent last[] = {LoopEvent::sensor, LoopEvent::predict, LoopEvent::belief, LoopEvent::action};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(events[11 + i], std::pair(40 * kMs, last[i]));
}

TEST(JitteredMap, IsThePeriodMapWithoutJitter) {
  const LinearLoop loop = groundLoop();
  const Eigen::Vector3d regular = loop.irregularGains(1)[1];
  for (const double phase : {0.0, 0.0055, 0.02}) {
    for (const double extra : {0.0, 0.013}) {
      const Eigen::MatrixXd map = loop.jitteredMap({1.0, extra, phase}, regular, 0.04);
      EXPECT_NEAR(spectralRadius(map), loop.spectralRadius(LoopMode::straight, {1.0, extra, phase}), 1e-6)
          << phase << ", " << extra;
    }
  }
}

TEST(JitterSearch, FindsGrowthInASequenceOfStablePeriodsOnlyIfTheClockIsIrregular) {
  const LinearLoop loop = groundLoop();
  for (const Jitter& jitter : {Jitter{0.02, 0}, Jitter{0.0, 3}}) {
    EXPECT_LT(worstGrowth(loop, jitter), 1.0) << jitter.extra_delay << " s, " << jitter.lost_samples << " lost";
  }
  for (const double delay : {0.0, 0.02, 0.04}) EXPECT_TRUE(loop.stable({1.0, delay})) << delay;
  EXPECT_GT(worstGrowth(loop, {0.04, 0}), 1.0);
}

}  // namespace
}  // namespace jackal_aic
