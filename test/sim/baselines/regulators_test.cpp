// The regulators of the baselines in cases of which the answer is known.

#include "regulators.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace jackal_aic::sim {
namespace {

constexpr double kRadius = 0.098;
constexpr double kT = WheelLaw::kPeriod;

/// A drive train with integral action, no limit and a dead time of whole action periods.
PlantModel model(int periods) {
  PlantModel m;
  m.dead_time = periods * kT;
  m.lag = 0.04;
  m.gain = 0.9;
  m.velocity_loop_integral = 3.0;
  m.acceleration_limit = 1e6;
  return m;
}

/// Commands of a regulator that sees these deviations, one per period.
std::vector<double> answers(Regulator& regulator, const std::vector<double>& deviations) {
  std::vector<double> commands;
  double v = 0.0;
  regulator.reset();
  for (const double e : deviations) {
    regulator.correct(e);
    commands.push_back(v = regulator.act());
    for (double t = 0.0; t < kT - 1e-9; t += WheelLaw::kStep) regulator.predict(v);
  }
  return commands;
}

std::vector<double> noise(std::size_t count) {
  std::mt19937_64 generator(3);
  std::normal_distribution<double> draw;
  std::vector<double> values(count);
  for (double& value : values) value = draw(generator);
  return values;
}

void expectSame(const std::vector<double>& a, const std::vector<double>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-12) << i;
}

TEST(Simc, GivesTheGainsOfItsRules) {
  PlantModel m = model(4);
  m.lag = 2.0;  // beyond 4 (tau_c + theta)
  const double tau_c = 0.1, theta = 0.08 + 0.5 * kT;
  const PidGains pi = simcGains(m, tau_c, false);
  EXPECT_NEAR(pi.proportional, 2.0 / (0.9 * (tau_c + theta)), 1e-12);
  EXPECT_NEAR(pi.proportional / pi.integral, 4.0 * (tau_c + theta), 1e-12);
  EXPECT_EQ(pi.derivative, 0.0);
  const PidGains pid = simcGains(m, tau_c, true);
  EXPECT_NEAR(pid.derivative, pi.proportional * theta / 3.0, 1e-12);
  EXPECT_EQ(pid.integral, pi.integral);
}

TEST(Pid, AddsUpItsParts) {
  Pid pid({2.0, 3.0, 0.1});
  expectSame(answers(pid, {1.0, 0.5}), {-(2.0 + 3.0 * kT + 0.1 / kT), -(1.0 + 3.0 * 1.5 * kT - 0.05 / kT)});
}

TEST(SmithPredictor, IsThePiControllerWhereThereIsNoDeadTime) {
  const PidGains gains{0.5, 4.0, 0.0};
  SmithPredictor smith(model(0), kRadius, gains);
  Pid pi(gains);
  const auto deviations = noise(50);
  expectSame(answers(smith, deviations), answers(pi, deviations));
}

TEST(DelayedInference, IsThePiControllerWhereItBelievesItsSensorAndThereIsNoDeadTime) {
  DelayedInference inference(model(0), kRadius, {1.0, 0.5, 4.0});
  Pid pi({0.5, 4.0, 0.0});
  const auto deviations = noise(50);
  expectSame(answers(inference, deviations), answers(pi, deviations));
}

TEST(Adrc, FindsAndCancelsTheDisturbanceOfAnIntegrator) {
  // dw/dt = b_0 v + 2 for the plant it is made for.
  const double b_0 = 10.0;
  Adrc adrc(model(0), {5.0, 20.0, b_0});
  adrc.reset();
  double w = 0.0, v = 0.0;
  for (int k = 0; k < 500; ++k) {
    adrc.correct(w);
    v = adrc.act();
    for (int i = 0; i < 20; ++i) adrc.predict(v);
    w += kT * (b_0 * v + 2.0);
  }
  EXPECT_NEAR(v, -2.0 / b_0, 1e-9);
  EXPECT_NEAR(w, 0.0, 1e-9);
}

TEST(RegulatorGain, OfAnIntegratorIsTheClosedFormSolution) {
  // P = P - P^2/(R + P) + Q has the root Q/2 + sqrt(Q^2/4 + Q R), K = P/(R + P).
  const double q = 0.3, r = 2.0, p = 0.5 * q + std::sqrt(0.25 * q * q + q * r);
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(1, 1);
  EXPECT_NEAR(regulatorGain(one, Eigen::VectorXd::Ones(1), q * one, r)(0), p / (r + p), 1e-12);
}

/// Plant with the last commands as states: (w, z, r of `periods` periods ago, ..., r of the last period).
struct Augmented {
  Eigen::MatrixXd transition, state_weight;
  Eigen::VectorXd input;
};

Augmented augmented(const PlantModel& m, int periods, double weight) {
  const DriveTrainResponse response = driveTrainResponse(m, kT);
  const int n = 2 + periods;
  Augmented a{Eigen::MatrixXd::Zero(n, n), Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)};
  a.transition.topLeftCorner<2, 2>() = response.transition;
  a.transition.block<2, 1>(0, 2) = response.input;
  for (int i = 0; i + 1 < periods; ++i) a.transition(2 + i, 3 + i) = 1.0;
  a.input(n - 1) = 1.0;
  a.state_weight(0, 0) = weight;
  return a;
}

TEST(Lqg, IsTheOptimalRegulatorOfThePlantWithTheCommandsUnderWayAsStates) {
  const int periods = 3;
  const PlantModel m = model(periods);
  const double weight = 2.0, command = 0.7;
  const Augmented a = augmented(m, periods, weight);
  const Eigen::RowVectorXd gain = regulatorGain(a.transition, a.input, a.state_weight, command);
  LqgWeights weights;
  weights.speed = weight;
  weights.command = command;
  const Lqg lqg(m, kRadius, weights);
  // K A^periods on (w, z), K A^(periods - 1 - i) B on the commands under way
  const DriveTrainResponse response = driveTrainResponse(m, kT);
  Eigen::RowVector2d ahead = lqg.gain();
  for (int i = periods - 1; i >= 0; --i) {
    EXPECT_NEAR(gain(2 + i), ahead.dot(response.input), 1e-9) << i;
    ahead = (ahead * response.transition).eval();
  }
  EXPECT_NEAR((gain.head<2>() - ahead).norm(), 0.0, 1e-9);
  EXPECT_GT(ahead.norm(), 0.01) << "nothing is fed back";
}

TEST(Lqg, WithoutWeightOnTheSpeedCancelsTheDisturbanceAlone) {
  LqgWeights weights;
  weights.speed = 0.0;
  EXPECT_NEAR(Lqg(model(3), kRadius, weights).gain().norm(), 0.0, 1e-12);
}

TEST(RegulatorGain, RefusesWhatCannotBeControlled) {
  const Eigen::MatrixXd unstable = Eigen::MatrixXd::Constant(1, 1, 1.1), one = Eigen::MatrixXd::Identity(1, 1);
  EXPECT_THROW(regulatorGain(unstable, Eigen::VectorXd::Zero(1), one, 1.0), ParameterError);
}

}  // namespace
}  // namespace jackal_aic::sim
