#include "return_difference.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// x ← x − gain x of `delay` periods ago.
Eigen::MatrixXd integrator(double gain, int delay) {
  Eigen::MatrixXd map = Eigen::MatrixXd::Zero(delay + 1, delay + 1);
  map(0, 0) = 1.0;
  map(0, delay) -= gain;
  for (int i = 0; i < delay; ++i) map(i + 1, i) = 1.0;
  return map;
}

Eigen::ArrayXd magnitudes(const Eigen::MatrixXd& map) {
  return Eigen::EigenSolver<Eigen::MatrixXd>(map, false).eigenvalues().cwiseAbs();
}

TEST(ReturnDifference, KnowsTheGainsOfADelayedIntegrator) {
  for (const int delay : {1, 4, 12}) {
    const ReturnDifference difference(integrator(0.0, delay), integrator(0.1, delay));
    ASSERT_TRUE(difference.known());
    std::vector<double> gains = difference.criticalGains();
    std::sort(gains.begin(), gains.end());
    // z − 1 = −k z^-n: ω = π (1 + 4 i) / (2 n + 1), k = 2 sin ω/2
    std::vector<double> expected;
    for (int i = 0; (4 * i + 1) <= 2 * delay + 1; ++i) {
      expected.push_back(20.0 * std::sin(0.5 * kPi * (4 * i + 1) / (2 * delay + 1)));
    }
    ASSERT_GE(gains.size(), expected.size()) << delay;
    EXPECT_NEAR(gains.front(), expected.front(), 1e-9) << delay;
    for (const double gain : expected) {
      EXPECT_TRUE(std::any_of(gains.begin(), gains.end(), [&](double g) { return std::abs(g - gain) < 1e-8; })) << gain;
    }
  }
}

TEST(ReturnDifference, KnowsTheDelayOfAnIntegrator) {
  // |z − 1| = k and arg L = d ω: (1 + 2 (n + d)) ω = π, k = 2 sin ω/2
  const double gain = 0.1, frequency = 2.0 * std::asin(0.5 * gain);
  const ReturnDifference difference(integrator(0.0, 3), integrator(gain, 3));
  const double delay = 0.5 * (kPi / frequency - 1.0) - 3.0, turn = 2.0 * kPi / frequency;
  EXPECT_NEAR(difference.criticalDelay(0.0), delay, 1e-8);
  EXPECT_NEAR(difference.criticalDelay(delay - 0.01), delay, 1e-8);
  EXPECT_NEAR(difference.criticalDelay(delay + 0.01), delay + turn, 1e-8);
}

TEST(ReturnDifference, IsNeverCriticalWithoutALoop) {
  const ReturnDifference difference(0.9 * Eigen::MatrixXd::Identity(2, 2), 0.9 * Eigen::MatrixXd::Identity(2, 2));
  EXPECT_TRUE(difference.criticalGains().empty());
  EXPECT_EQ(difference.criticalDelay(0.0), HUGE_VAL);
}

/// The eigenvalues cross the unit circle at the critical gains, and nowhere else.
TEST(ReturnDifference, ForetellsEveryChangeOfTheNumberOfUnstableEigenvalues) {
  std::srand(3);
  int changes = 0;
  for (int sample = 0; sample < 200; ++sample) {
    Eigen::MatrixXd open = Eigen::MatrixXd::Random(9, 9);
    open *= 0.95 / magnitudes(open).maxCoeff();
    const Eigen::MatrixXd driven = Eigen::VectorXd::Random(9) * Eigen::RowVectorXd::Random(9);
    const ReturnDifference difference(open, open + driven);
    ASSERT_TRUE(difference.known());
    std::vector<double> gains = difference.criticalGains();
    gains.push_back(1e-3);
    gains.push_back(1e3);
    std::sort(gains.begin(), gains.end());
    const auto unstable = [&](double gain) { return (magnitudes(open + gain * driven) > 1.0).count(); };
    for (double gain = 1e-3; gain < 1e3; gain *= 1.02) {
      const auto next = std::upper_bound(gains.begin(), gains.end(), gain);
      if (*next <= 1.02 * gain) continue;
      EXPECT_EQ(unstable(gain), unstable(1.02 * gain)) << sample << ", gain " << gain;
    }
    for (const double gain : gains) {
      if (gain <= 1e-3 || gain >= 1e3) continue;
      ++changes;
      EXPECT_NEAR((magnitudes(open + gain * driven) - 1.0).abs().minCoeff(), 0.0, 1e-6) << sample << ", gain " << gain;
    }
  }
  EXPECT_GT(changes, 200);
}

TEST(ReturnDifference, SaysWhereItKnowsNothing) {
  const Eigen::MatrixXd map = Eigen::MatrixXd::Constant(2, 2, std::nan(""));
  EXPECT_FALSE(ReturnDifference(map, map).known());
}

}  // namespace
}  // namespace jackal_aic
