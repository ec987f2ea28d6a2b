#pragma once

/// @file
/// Log densities of prediction errors.

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/square.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic::faults {

/// Mean and variance of an uncertain value.
struct Normal {
  double mean = 0.0;
  double variance = 0.0;
};

/// Part of a predicted change by which the prediction errs from sample to sample.
inline constexpr double kPaceDoubt = 0.5;

/// Degrees of freedom nu of Student's t, the density of all prediction errors: its tails leave room for outliers.
inline constexpr double kTail = 4.0;

/// Largest ratio of a squared error to its variance which a learned variance takes from one sample, and beyond which a
/// value has left its prediction.
inline constexpr double kLargestRatio = square(thresholds::kSure);

/// Variance of a sensor's noise before it is known, in multiples of the least one.
inline constexpr double kUnknownNoise = 25.0;

/// Keeps a quotient or a logarithm finite.
inline constexpr double kTiny = 1e-12;

/// ln of the density of what a hypothesis excludes: e^-60.
inline constexpr double kImpossible = -60.0;

/// ln t_nu(e; 0, S). @param squared e^2; @param variance S.
inline double logStudent(double squared, double variance) {
  constexpr double kConstant = -0.9808292530117262;  // ln(3/8), of nu = 4
  return kConstant - 0.5 * std::log(variance) - 0.5 * (kTail + 1.0) * std::log1p(squared / (kTail * variance));
}

/// Weight of a sample in an estimate whose errors have Student's t, at most 1 (West 1981).
inline double studentWeight(double squared, double variance) {
  return std::min(1.0, (kTail + 1.0) / (kTail + squared / variance));
}

/// ln N(e; 0, S).
inline double logNormal(double error, double variance) {
  return -0.5 * (std::log(2.0 * M_PI * variance) + error * error / variance);
}

/// ln(e^a + e^b).
inline double logSum(double a, double b) {
  return a > b ? a + std::log1p(std::exp(b - a)) : b + std::log1p(std::exp(a - b));
}

/// Probability of ln odds.
inline double probabilityOf(double odds) { return 1.0 / (1.0 + std::exp(-odds)); }

/// ln((1 - p) e^a + p e^b).
inline double logMixture(double share, double a, double b) {
  return logSum(std::log1p(-share) + a, std::log(share) + b);
}

/// ln P(|b| > least).
inline double logBeyond(const Normal& b, double least) {
  const double scale = 1.0 / std::sqrt(2.0 * b.variance);
  return std::log(0.5 * (std::erfc((least - b.mean) * scale) + std::erfc((least + b.mean) * scale)) + kTiny);
}

/// ln of the density of a sample that is none with a probability: then it says nothing. @param log_density as if it
/// were one, relative to that of the best hypothesis.
inline double logUnless(double none, double log_density) {
  return std::log(none + (1.0 - none) * std::exp(log_density));
}

}  // namespace jackal_aic::faults
