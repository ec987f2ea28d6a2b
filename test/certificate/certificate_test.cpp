#include "jackal_aic/certificate/certificate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include "../complaint.hpp"
#include "ground.hpp"

namespace jackal_aic {
namespace {

constexpr double kPi = 3.14159265358979323846;

PlantModel known() {
  PlantModel plant;
  plant.dead_time = 0.083;
  plant.lag = 0.008;
  return plant;
}

ControllerParameters improved(double kappa_a = ControllerParameters{}.kappa_a) {
  ControllerParameters controller;
  controller.belief_rate = 1000.0;
  controller.tau = 0.001;
  controller.kappa_mu = 0.1;
  controller.kappa_a = kappa_a;
  return controller;
}

TEST(Certificate, GainMarginOfAnIntegratorWithDeadTime) {
  ControllerParameters controller;
  controller.orders = 0;
  controller.kappa_mu = 1e-5;
  controller.tau = 1e-5;
  PlantModel plant;
  plant.lag = 0.0;
  plant.dead_time = 0.08;  // n = 4, with an older measurement 5: step gain below 2 sin(pi / 22)
  const double step_gain = controller.actionStep() * controller.kappa_a / controller.sensory_variances[0];
  const Certificate certificate = certify(controller, {}, plant);
  EXPECT_NEAR(certificate.straight.gain_margin, 2.0 * std::sin(kPi / 22.0) / step_gain, 1e-3);
  // The step gain of 0.08 is below the limit up to n = 19 and above it from n = 20, with an older measurement at 0.38
  // s.
  EXPECT_NEAR(certificate.straight.delay_margin, 0.38 - 0.08, 1e-4);
}

TEST(Certificate, MarginsAreWhereTheRadiusIsOne) {
  for (const double kappa_a : {4.0, 8.0, 22.0, 25.0, 40.0}) {
    SCOPED_TRACE(kappa_a);
    const LinearLoop loop(improved(kappa_a), {}, {});
    const Certificate certificate = certify(improved(kappa_a), {}, {});
    for (const auto& [mode, margins] :
         {std::pair(LoopMode::straight, certificate.straight), std::pair(LoopMode::turn, certificate.turn)}) {
      EXPECT_NEAR(loop.worstSpectralRadius(mode, {margins.gain_margin, 0.0}).value, 1.0, 1e-4);
      EXPECT_NEAR(loop.worstSpectralRadius(mode, {1.0, margins.delay_margin}).value, 1.0, 1e-4);
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
  EXPECT_GT(certificate.loop_spectral_radius, 1.0);
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
  PlantModel late = ground();
  late.dead_time = 0.4;
  const std::tuple<LinearLoop, std::vector<std::string>> rows[] = {
      {{improved(40.0), {}, known()},
       {"controller: the closed loop diverges: spectral radius 1.055", "kappa_a = 40 is too large: stable below 26.4"}},
      {{improved(0.0), {}, known()}, {"kappa_a = 0 never corrects the action: raise it"}},
      {{euler, {}, known()},
       {"the belief update diverges: spectral radius 65.68", "use integrator: exact, or raise tau"}},
      {{PredictiveParameters{}, ground(), late},
       {"spectral radius", "plant_model.dead_time = 0.4 s", "stable with a dead time below 0.2"}},
      {{idle, ground(), ground()}, {"predictive.action_learning_rate = 0 never corrects"}}};
  for (const auto& [loop, parts] : rows) {
    const std::string line = complaint([loop = loop] { requireStable(loop); });
    for (const std::string& part : parts) expectSays(line, {part});
    EXPECT_FALSE(certify(loop).stable());
  }
  for (const LinearLoop& stable : {LinearLoop(improved(), {}, known()), LinearLoop(ControllerParameters{}, {}, {}),
                                   LinearLoop(PredictiveParameters{}, ground(), ground())}) {
    EXPECT_NO_THROW(requireStable(stable));
  }
  PlantModel odd = ground();
  odd.sensor_rate = 49.3;
  EXPECT_THROW(certify(PredictiveParameters{}, ground(), odd), ParameterError);
}

TEST(Advice, DistinguishesStableThinAndUnstable) {
  PlantModel strong = ground(), late = ground();
  strong.gain = 2.0;
  late.dead_time = 0.4;
  ControllerParameters slow = improved(0.01);
  slow.action_rate = 500;
  const std::pair<LinearLoop, const char*> rows[] = {
      {{improved(8.0), {}, {}}, "Stable with room"},
      {{improved(22.0), {}, {}}, "Stable, but with a thin margin"},
      {{improved(40.0), {}, {}}, "Unstable"},
      {{PredictiveParameters{}, ground(), ground()}, "Stable with room"},
      {{PredictiveParameters{}, ground(), strong}, "Stable, but with a thin margin"},
      {{PredictiveParameters{}, ground(), late}, "Unstable"},
      {{slow, {}, {}}, "the dead time by more than 0.5 s"}};  // where the search ended
  for (const auto& [loop, part] : rows) expectSays(advice(certify(loop), loop), {part});
}

}  // namespace
}  // namespace jackal_aic
