// Smoothness and variance of noise, learned together, against noise of which they are known.

#include "jackal_aic/predictive/smoothness_learning.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <random>

#include "jackal_aic/aic/coloured_noise.hpp"

namespace jackal_aic {
namespace {

constexpr double kStep = 0.02;   // s
constexpr double kWhite = 9e-4;  // N
using Window = SmoothNoise::Window;
using WindowMatrix = SmoothNoise::WindowMatrix;

/// Samples of noise with the autocorrelation Sigma exp(-t^2/(4 s^2)) + N delta: white noise through a Gaussian of
/// width s, and white noise beside.
class Source {
 public:
  Source(const SmoothNoise& noise, std::uint64_t seed) : noise_(noise), generator_(seed) {
    const int reach = static_cast<int>(std::ceil(6.0 * noise.smoothness / kStep));
    kernel_ = Eigen::VectorXd::Ones(2 * reach + 1);
    for (int i = -reach; i <= reach && reach > 0; ++i) {
      kernel_(i + reach) = std::exp(-0.5 * std::pow(i * kStep / noise.smoothness, 2));
    }
    kernel_.normalize();
    past_ = kernel_.unaryExpr([this](double) { return normal_(generator_); });
  }

  double next() {
    const Eigen::VectorXd later = past_.tail(past_.size() - 1);
    past_.head(later.size()) = later;
    past_(past_.size() - 1) = normal_(generator_);
    return std::sqrt(noise_.variance) * kernel_.dot(past_) + std::sqrt(noise_.white_variance) * normal_(generator_);
  }

 private:
  SmoothNoise noise_;
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
  Eigen::VectorXd kernel_, past_;
};

/// What is learned from noise that is seen as it is.
SmoothNoise learned(const SmoothNoise& truth, SmoothnessLearning learning, double seconds, std::uint64_t seed) {
  Source source(truth, seed);
  Window n = Window::Zero();
  for (int k = 0; k < static_cast<int>(seconds / kStep); ++k) {
    const Window before = n;
    n << source.next(), before.head<SmoothNoise::kOrders>();
    if (k >= SmoothNoise::kOrders) learning.learn(n * n.transpose(), kStep);
  }
  return learning.noise();
}

double freeEnergy(const SmoothNoise& noise, const WindowMatrix& moments) {
  const WindowMatrix R = noise.covariance(kStep);
  return 0.5 * (R.inverse() * moments).trace() + 0.5 * std::log(R.determinant());
}

TEST(SmoothNoise, DifferencesOfShortStepsHaveThePrecisionOfGeneralisedCoordinates) {
  constexpr double s = 1.0, step = 0.02;
  SmoothNoise noise;
  noise.white_variance = 0.0;
  noise.variance = 3.0;
  noise.smoothness = s;
  WindowMatrix T = WindowMatrix::Zero();  // backward differences of order 0..p over h^i
  for (int i = 0; i < T.rows(); ++i) {
    double binomial = 1.0;
    for (int j = 0; j <= i; ++j) {
      T(i, j) = binomial / std::pow(step, i);
      binomial *= -static_cast<double>(i - j) / (j + 1);
    }
  }
  const WindowMatrix of_differences = T * noise.covariance(step) * T.transpose() / noise.variance;
  const Eigen::MatrixXd V = Eigen::MatrixXd(noisePrecision(SmoothNoise::kOrders, s)).inverse();
  EXPECT_LT((of_differences - V).norm(), 0.05 * V.norm());
}

TEST(SmoothnessLearning, GoesDownTheFreeEnergy) {
  for (const double s : {0.01, 0.02, 0.1}) {
    for (const double variance : {1e-4, 1e-2}) {
      const SmoothNoise at{kWhite, variance, s};
      WindowMatrix moments = SmoothNoise{kWhite, 4e-3, 0.03}.covariance(kStep);
      SmoothnessLearning learning(at, 10.0);
      learning.learn(moments, kStep);
      EXPECT_LT(freeEnergy(learning.noise(), moments), freeEnergy(at, moments)) << s << ", " << variance;
    }
  }
}

TEST(SmoothnessLearning, StaysWhereItIsRight) {
  const SmoothNoise at{kWhite, 4e-3, 0.03};
  SmoothnessLearning learning(at, 10.0);
  for (int k = 0; k < 1000; ++k) learning.learn(at.covariance(kStep), kStep);
  EXPECT_NEAR(learning.noise().variance, at.variance, 1e-9);
  EXPECT_NEAR(learning.noise().smoothness, at.smoothness, 1e-9);
}

class OfSmoothness : public testing::TestWithParam<double> {};

TEST_P(OfSmoothness, FindsBothWithinAQuarterFromWrongStarts) {
  const SmoothNoise truth{kWhite, 0.04, GetParam()};
  for (const SmoothNoise& start : {SmoothNoise{kWhite, 9e-6, 0.005}, SmoothNoise{kWhite, 1.0, 0.3}}) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      const SmoothNoise found = learned(truth, SmoothnessLearning(start, 30.0), 180.0, seed);
      EXPECT_NEAR(found.smoothness / truth.smoothness, 1.0, 0.25) << "seed " << seed;
      EXPECT_NEAR(std::sqrt(found.variance / truth.variance), 1.0, 0.35) << "seed " << seed;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Smoothness, OfSmoothness, testing::Values(0.02, 0.05, 0.1));

TEST(SmoothnessLearning, FindsWhiteNoiseToBeWhite) {
  const SmoothNoise truth{kWhite, 0.04, 0.0};
  for (const SmoothNoise& start : {SmoothNoise{kWhite, 9e-6, 0.005}, SmoothNoise{kWhite, 1.0, 0.3}}) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      const WindowMatrix R = learned(truth, SmoothnessLearning(start, 30.0), 180.0, seed).covariance(kStep);
      EXPECT_LT(R(0, 1) / R(0, 0), 0.15) << "seed " << seed;  // 0.02 is the least that it can say
      EXPECT_NEAR(R(0, 0) / (truth.variance + kWhite), 1.0, 0.2) << "seed " << seed;
    }
  }
}

TEST(SmoothnessLearning, SmoothNoiseThatIsNotThereVanishes) {
  const SmoothNoise truth{kWhite, 0.0, 0.0}, start{kWhite, 0.01, 0.05};
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const WindowMatrix R = learned(truth, SmoothnessLearning(start, 30.0), 180.0, seed).covariance(kStep);
    EXPECT_NEAR(R(0, 0) / kWhite, 1.0, 0.15) << "seed " << seed;
  }
}

TEST(SmoothnessLearning, FollowsNoiseThatChanges) {
  const SmoothNoise white{kWhite, 0.04, 0.0}, smooth{kWhite, 0.04, 0.05};
  SmoothnessLearning learning(white, 10.0);
  learning = SmoothnessLearning(learned(white, learning, 60.0, 1), 10.0);
  EXPECT_NEAR(learned(smooth, learning, 60.0, 2).smoothness, 0.05, 0.015);
}

TEST(SmoothnessLearning, AnOutlierDoesNotTurnItOver) {
  const SmoothNoise at{kWhite, 4e-3, 0.03};
  SmoothnessLearning learning(at, 10.0);
  learning.learn(WindowMatrix::Constant(1e6), kStep);
  EXPECT_NEAR(learning.noise().smoothness, at.smoothness, 0.06 * at.smoothness);
  EXPECT_NEAR(learning.noise().variance, at.variance, 0.06 * at.variance);
  learning.learn(WindowMatrix::Identity(), 0.0);
  EXPECT_TRUE(std::isfinite(learning.noise().smoothness));
}

}  // namespace
}  // namespace jackal_aic
