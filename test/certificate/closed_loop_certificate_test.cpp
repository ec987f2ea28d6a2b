#include "jackal_aic/certificate/closed_loop_certificate.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "jackal_aic/certificate/advice.hpp"

namespace jackal_aic {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Drive train of which the numbers below are, whatever the default is.
PlantModel known() {
  PlantModel plant;
  plant.dead_time = 0.083;
  plant.lag = 0.008;
  return plant;
}

ControllerParameters improved() {
  ControllerParameters controller;
  controller.belief_rate = 1000.0;
  controller.tau = 0.001;
  controller.kappa_mu = 0.1;
  return controller;
}

ControllerParameters withActionGain(double kappa_a) {
  ControllerParameters controller = improved();
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
  // The step gain of 0.08 is below the limit up to n = 19 and above it from n = 20: with an older measurement at 0.38
  // s.
  EXPECT_NEAR(certificate.straight.delay_margin, 0.38 - 0.08, 1e-4);
}

TEST(Certificate, MarginsAreWhereTheRadiusIsOne) {
  for (const double kappa_a : {4.0, 8.0, 25.0, 40.0}) {
    const ControllerParameters controller = withActionGain(kappa_a);
    const LinearLoop loop(controller, {}, {});
    const Certificate certificate = certify(controller, {}, {});
    for (const auto& [mode, margins] :
         {std::pair(LoopMode::straight, certificate.straight), std::pair(LoopMode::turn, certificate.turn)}) {
      EXPECT_NEAR(loop.worstSpectralRadius(mode, {margins.gain_margin, 0.0}), 1.0, 1e-4) << kappa_a;
      EXPECT_NEAR(loop.worstSpectralRadius(mode, {1.0, margins.delay_margin}), 1.0, 1e-4) << kappa_a;
    }
    EXPECT_EQ(certificate.gain_margin, std::min(certificate.straight.gain_margin, certificate.turn.gain_margin));
    EXPECT_EQ(certificate.delay_margin, std::min(certificate.straight.delay_margin, certificate.turn.delay_margin));
  }
}

TEST(Certificate, MarginsAreSharp) {
  for (const double kappa_a : {4.0, 8.0, 22.0}) {
    const LinearLoop loop(withActionGain(kappa_a), {}, {});
    const Certificate certificate = certify(loop.controller(), {}, {});
    for (const auto& [mode, margins] :
         {std::pair(LoopMode::straight, certificate.straight), std::pair(LoopMode::turn, certificate.turn)}) {
      EXPECT_TRUE(loop.stable(mode, {margins.gain_margin, 0.0})) << kappa_a;
      EXPECT_FALSE(loop.stable(mode, {1.00001 * margins.gain_margin, 0.0})) << kappa_a;
      EXPECT_TRUE(loop.stable(mode, {1.0, margins.delay_margin})) << kappa_a;
      EXPECT_FALSE(loop.stable(mode, {1.0, 1.00001 * margins.delay_margin})) << kappa_a;
      EXPECT_EQ(margins.gain_reduction, 0.0) << kappa_a;
    }
  }
}

TEST(Certificate, UnstableGainsHaveMarginsThatSayHowFarToGoBack) {
  const Certificate certificate = certify(withActionGain(40.0), {}, {});
  EXPECT_FALSE(certificate.stable());
  EXPECT_GT(certificate.loop_spectral_radius, 1.0);
  EXPECT_LT(certificate.gain_margin, 1.0);
  EXPECT_LT(certificate.delay_margin, 0.0);
  EXPECT_TRUE(certify(withActionGain(0.99 * 40.0 * certificate.gain_margin), {}, {}).stable());
  PlantModel faster;
  faster.dead_time += certificate.delay_margin - 0.001;
  EXPECT_TRUE(certify(withActionGain(40.0), {}, faster).stable());
}

TEST(Certificate, MoreDeadTimeTakesThatMuchOfTheDelayMargin) {
  PlantModel slower;
  slower.dead_time += 0.04;
  EXPECT_NEAR(certify(improved(), {}, {}).delay_margin - certify(improved(), {}, slower).delay_margin, 0.04, 1e-4);
}

TEST(Certificate, RestingActionIsNotStable) { EXPECT_FALSE(certify(withActionGain(0.0), {}, {}).stable()); }

TEST(Certificate, PresetsAreStableOnTheDefaultPlant) {
  EXPECT_TRUE(certify(ControllerParameters{}, {}, {}).stable());
  EXPECT_TRUE(certify(improved(), {}, {}).stable());
}

TEST(Sensitivities, AreTheSlopeOfTheRadius) {
  const ControllerParameters controller = withActionGain(30.0);
  const auto list = sensitivities(controller, {}, {});
  ASSERT_EQ(list.size(), 5u);
  EXPECT_EQ(list.front().parameter, "kappa_a");
  const double more = LinearLoop(withActionGain(30.3), {}, {}).worstSpectralRadius();
  const double less = LinearLoop(withActionGain(29.7), {}, {}).worstSpectralRadius();
  EXPECT_NEAR(list.front().value, std::log(more / less) / std::log(30.3 / 29.7), 1e-6);
  for (std::size_t i = 1; i < list.size(); ++i) EXPECT_LE(std::abs(list[i].value), std::abs(list[i - 1].value));
}

TEST(Sensitivities, AreOfTheBeliefWhereThatDiverges) {
  ControllerParameters controller = improved();
  controller.integrator = Integrator::euler;
  const auto list = sensitivities(controller, {}, {});
  EXPECT_EQ(list.front().parameter, "tau");
  EXPECT_NEAR(list.front().value, -2.0, 0.1);  // h kappa_mu Pi_mu / tau^2
}

TEST(StableRange, EndsWhereTheGainMarginSays) {
  const auto range = stableRange(improved(), {}, {}, Gain::kappa_a);
  ASSERT_TRUE(range);
  EXPECT_TRUE(range->low_is_bound);
  EXPECT_FALSE(range->high_is_bound);
  EXPECT_NEAR(range->high, 8.0 * certify(improved(), {}, {}).gain_margin, 0.01);
}

TEST(StableRange, IsTheNearestOneForAnUnstableValue) {
  const auto range = stableRange(withActionGain(100.0), {}, {}, Gain::kappa_a);
  ASSERT_TRUE(range);
  EXPECT_NEAR(range->high, stableRange(improved(), {}, {}, Gain::kappa_a)->high, 0.01);
}

TEST(StableRange, HasEulersLimitForTau) {
  ControllerParameters controller = improved();
  controller.integrator = Integrator::euler;
  const auto range = stableRange(controller, {}, {}, Gain::tau);
  ASSERT_TRUE(range);
  // h kappa_mu Pi_mu / tau^2 = 2 gives 0.00577 s; the other orders need a little more
  EXPECT_GT(range->low, 0.0055);
  EXPECT_LT(range->low, 0.0085);
  ControllerParameters inside = controller, outside = controller;
  inside.tau = 1.001 * range->low;
  outside.tau = 0.999 * range->low;
  EXPECT_TRUE(certify(inside, {}, {}).stable());
  EXPECT_FALSE(certify(outside, {}, {}).stable());
}

TEST(StableRange, IsEmptyIfNoValueHelps) {
  PlantModel slow;
  slow.dead_time = 0.5;
  EXPECT_FALSE(stableRange(withActionGain(1000.0), {}, slow, Gain::kappa_mu));
}

TEST(ThinMargin, NamesTheBoundThatIsNotKept) {
  const auto thin = [](double kappa_a, const MarginBounds& bounds) {
    return thinMargin(LinearLoop(withActionGain(kappa_a), {}, known()), bounds);
  };
  EXPECT_EQ(thin(8.0, {}), "");
  EXPECT_NE(thin(8.0, {3.4, 0.03}).find("3.4 times the kappa_a"), std::string::npos);
  EXPECT_NE(thin(8.0, {1.5, 0.28}).find("0.28 s more dead time"), std::string::npos);
  EXPECT_TRUE(certify(withActionGain(8.0), {}, known()).keeps({3.2, 0.25}));
  EXPECT_FALSE(certify(withActionGain(8.0), {}, known()).keeps({3.4, 0.25}));
  EXPECT_FALSE(certify(withActionGain(8.0), {}, known()).keeps({3.2, 0.28}));
}

TEST(RequireInRange, RefusesWhatTheFileMayNotHold) {
  EXPECT_NO_THROW(requireInRange(improved()));
  for (const double kappa_a : {-1.0, 1e5, std::nan(""), HUGE_VAL}) {
    EXPECT_THROW(requireInRange(withActionGain(kappa_a)), ParameterError) << kappa_a;
  }
  ControllerParameters fast = improved();
  fast.tau = 1e-6;
  EXPECT_THROW(requireInRange(fast), ParameterError);
}

TEST(RequireStable, NamesRadiusAndParameter) {
  EXPECT_NO_THROW(requireStable(improved(), {}, known()));
  try {
    requireStable(withActionGain(40.0), {}, known());
    FAIL() << "accepted";
  } catch (const ParameterError& error) {
    const std::string line = error.what();
    EXPECT_NE(line.find("spectral radius 1.055"), std::string::npos) << line;
    EXPECT_NE(line.find("kappa_a = 40 is most to blame (stable below 26.4"), std::string::npos) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos);
  }
}

TEST(RequireStable, NamesTheGainThatWasChanged) {
  const ControllerParameters running = improved();
  ControllerParameters slow_belief = withActionGain(40.0);
  slow_belief.tau = 0.002;  // harmless by itself
  for (const ControllerParameters& wanted : {withActionGain(0.0), slow_belief}) {
    try {
      requireStable(wanted, {}, known(), &running);
      ADD_FAILURE() << "accepted";
    } catch (const ParameterError& error) {
      const std::string line = error.what();
      EXPECT_NE(line.find(wanted.kappa_a == 0.0 ? "kappa_a = 0 is most to blame (stable between 0 and 26.4"
                                                : "kappa_a = 40 is most to blame (stable below"),
                std::string::npos)
          << line;
    }
  }
}

TEST(Advice, TellsStableThinAndUnstableApart) {
  const auto text = [](double kappa_a) {
    const ControllerParameters controller = withActionGain(kappa_a);
    return advice(certify(controller, {}, {}), controller, {}, {});
  };
  EXPECT_EQ(text(8.0).find("Stable with room"), 0u) << text(8.0);
  EXPECT_EQ(text(22.0).find("Stable, but with a thin margin"), 0u) << text(22.0);
  EXPECT_EQ(text(40.0).find("Unstable"), 0u) << text(40.0);
}

TEST(Advice, SaysWhereTheSearchForTheDelayMarginEnded) {
  ControllerParameters slow = withActionGain(0.01);
  slow.action_rate = 500;
  const std::string text = advice(certify(slow, {}, {}), slow, {}, {});
  EXPECT_NE(text.find("the dead time by more than 0.5 s"), std::string::npos) << text;
}

}  // namespace
}  // namespace jackal_aic
