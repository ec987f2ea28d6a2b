#include "jackal_aic/certificate/certificate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace jackal_aic {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Drive train of the numbers below, independent of the defaults.
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
      EXPECT_NEAR(loop.worstSpectralRadius(mode, {margins.gain_margin, 0.0}).value, 1.0, 1e-4) << kappa_a;
      EXPECT_NEAR(loop.worstSpectralRadius(mode, {1.0, margins.delay_margin}).value, 1.0, 1e-4) << kappa_a;
    }
    EXPECT_EQ(certificate.gain_margin, std::min(certificate.straight.gain_margin, certificate.turn.gain_margin));
    EXPECT_EQ(certificate.delay_margin, std::min(certificate.straight.delay_margin, certificate.turn.delay_margin));
  }
}

TEST(Certificate, MarginsAreSharp) {
  for (const double kappa_a : {4.0, 8.0, 22.0}) {
    const LinearLoop loop(withActionGain(kappa_a), {}, {});
    const Certificate certificate = certify(loop);
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

TEST(Certificate, KeepsTheBoundsUpToItsMargins) {
  const Certificate certificate = certify(withActionGain(8.0), {}, known());
  EXPECT_TRUE(certificate.keeps({3.2, 0.25}));
  EXPECT_FALSE(certificate.keeps({3.4, 0.25}));
  EXPECT_FALSE(certificate.keeps({3.2, 0.28}));
}

TEST(Certificate, AShorterDeadTimeDoesNoHarm) {
  EXPECT_DOUBLE_EQ(certify(improved(), {}, known()).delay_reduction, known().dead_time);
  EXPECT_EQ(certify(withActionGain(40.0), {}, {}).delay_reduction, 0.0) << "of an unstable loop";
}

/// What requireStable() says of a loop; empty if it accepts it.
std::string refusal(const LinearLoop& loop) {
  try {
    requireStable(loop);
    return "";
  } catch (const ParameterError& error) {
    return error.what();
  }
}

TEST(RequireStable, NamesTheRadiusAndTheLargestStableGain) {
  EXPECT_EQ(refusal(LinearLoop(improved(), {}, known())), "");
  const std::string line = refusal(LinearLoop(withActionGain(40.0), {}, known()));
  EXPECT_NE(line.find("controller: the closed loop diverges: spectral radius 1.055"), std::string::npos) << line;
  EXPECT_NE(line.find("kappa_a = 40 is too large: stable below 26.4"), std::string::npos) << line;
  EXPECT_EQ(line.find('\n'), std::string::npos);
}

TEST(RequireStable, SaysThatAnActionWithoutAGainNeverMoves) {
  const std::string line = refusal(LinearLoop(withActionGain(0.0), {}, known()));
  EXPECT_NE(line.find("kappa_a = 0 never corrects the action: raise it"), std::string::npos) << line;
}

TEST(RequireStable, NamesTheIntegratorOfABeliefThatDiverges) {
  ControllerParameters euler = improved();
  euler.integrator = Integrator::euler;
  const std::string line = refusal(LinearLoop(euler, {}, known()));
  EXPECT_NE(line.find("the belief update diverges: spectral radius 65.68"), std::string::npos) << line;
  EXPECT_NE(line.find("use integrator: exact, or raise tau"), std::string::npos) << line;
}

TEST(Advice, DistinguishesStableThinAndUnstable) {
  const auto text = [](double kappa_a) {
    const LinearLoop loop(withActionGain(kappa_a), {}, {});
    return advice(certify(loop), loop);
  };
  EXPECT_EQ(text(8.0).find("Stable with room"), 0u) << text(8.0);
  EXPECT_EQ(text(22.0).find("Stable, but with a thin margin"), 0u) << text(22.0);
  EXPECT_EQ(text(40.0).find("Unstable"), 0u) << text(40.0);
}

TEST(Advice, SaysThatActionBoundAndStandstillAreOutsideUnlessTheyAreOff) {
  const auto isOutside = [](bool printed, double kappa_a) {
    ControllerParameters gains = withActionGain(kappa_a);
    gains.printed = printed;
    const LinearLoop loop(gains, {}, {});
    return advice(certify(loop), loop).find("Action bound and standstill are outside the certificate") !=
           std::string::npos;
  };
  for (const double kappa_a : {8.0, 22.0}) {
    EXPECT_TRUE(isOutside(false, kappa_a));
    EXPECT_FALSE(isOutside(true, kappa_a));
  }
}

TEST(Advice, SaysWhereTheSearchForTheDelayMarginEnded) {
  ControllerParameters slow = withActionGain(0.01);
  slow.action_rate = 500;
  const LinearLoop loop(slow, {}, {});
  const std::string text = advice(certify(loop), loop);
  EXPECT_NE(text.find("the dead time by more than 0.5 s"), std::string::npos) << text;
}

}  // namespace
}  // namespace jackal_aic
