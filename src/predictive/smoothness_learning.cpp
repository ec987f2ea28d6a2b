#include "jackal_aic/predictive/smoothness_learning.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

using WindowMatrix = SmoothNoise::WindowMatrix;

constexpr double kPrior = 0.01;        // curvature of F along ln Sigma and ln s before anything is known
constexpr double kLargestStep = 0.05;  // of both in one measurement: an outlier must not turn what was learned over
constexpr double kRange = 1e4;         // of Sigma / N, to either side of 1

/// (i - j)^2 h^2 / (4 s^2)
double exponent(Eigen::Index lag, double step, double smoothness) {
  const double x = static_cast<double>(lag) * step / (2.0 * smoothness);
  return x * x;
}

/// Sigma rho and its derivative by ln s; that by ln Sigma is itself.
struct SmoothPart {
  WindowMatrix covariance, by_smoothness;
};

SmoothPart smoothPart(const SmoothNoise& noise, double step) {
  SmoothPart part;
  for (Eigen::Index i = 0; i < part.covariance.rows(); ++i) {
    for (Eigen::Index j = 0; j < part.covariance.cols(); ++j) {
      const double x = noise.smoothness > 0.0 ? exponent(i - j, step, noise.smoothness) : i == j ? 0.0 : HUGE_VAL;
      const double rho = std::exp(-x);
      part.covariance(i, j) = noise.variance * rho;
      part.by_smoothness(i, j) = rho > 0.0 ? 2.0 * x * noise.variance * rho : 0.0;
    }
  }
  return part;
}

}  // namespace

WindowMatrix SmoothNoise::covariance(double step) const {
  WindowMatrix R = smoothPart(*this, step).covariance;
  R.diagonal().array() += white_variance;
  return R;
}

SmoothnessLearning::SmoothnessLearning(const SmoothNoise& start, double memory) : noise_(start), memory_(memory) {
  if (noise_.variance <= 0.0) noise_.variance = 0.01 * noise_.white_variance;
}

void SmoothnessLearning::learn(const WindowMatrix& moments, double step) {
  if (!(step > 0.0)) return;
  noise_.smoothness = std::clamp(noise_.smoothness, kLeast * step, kMost);
  const SmoothPart smooth = smoothPart(noise_, step);
  WindowMatrix R = smooth.covariance;
  R.diagonal().array() += noise_.white_variance;
  const WindowMatrix R_inverse = R.inverse();
  const WindowMatrix A = R_inverse * smooth.covariance, B = R_inverse * smooth.by_smoothness;

  // ∂F/∂θ_a = ½ tr(R⁻¹ ∂R_a) − ½ tr(R⁻¹ E[n n'] R⁻¹ ∂R_a)
  const WindowMatrix missing = WindowMatrix::Identity() - R_inverse * moments;
  const Eigen::Vector2d gradient = 0.5 * Eigen::Vector2d((missing * A).trace(), (missing * B).trace());

  // I_ab = ½ tr(R⁻¹ ∂R_a R⁻¹ ∂R_b)
  Eigen::Matrix2d curvature;
  curvature << (A * A).trace(), (A * B).trace(), (A * B).trace(), (B * B).trace();
  curvature = (0.5 * curvature + kPrior * Eigen::Matrix2d::Identity()).eval();

  // θ ← θ − h/T I⁻¹ ∂F/∂θ
  const Eigen::Vector2d change = std::min(step / memory_, 1.0) * (curvature.inverse() * gradient);
  const auto moved = [](double change) { return std::exp(-std::clamp(change, -kLargestStep, kLargestStep)); };
  const double N = noise_.white_variance;
  noise_.variance = std::clamp(noise_.variance * moved(change(0)), N / kRange, N * kRange);
  noise_.smoothness = std::clamp(noise_.smoothness * moved(change(1)), kLeast * step, kMost);
}

}  // namespace jackal_aic
