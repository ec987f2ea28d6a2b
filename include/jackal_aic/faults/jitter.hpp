#pragma once

/// @file
/// Variance of a sensor's white noise, learned from its prediction errors.

#include <algorithm>

#include "jackal_aic/faults/density.hpp"

namespace jackal_aic::faults {

/// Von Neumann's estimate by second differences, var = E[(e_k - 2 e_k-1 + e_k-2)^2]/6: neither an offset nor a ramp of
/// the error enters it.
class Jitter {
 public:
  /// @param least variance that the sensor has at least.
  explicit Jitter(double least) : least_(least), variance_(kUnknownNoise * least) {}

  /// Takes a prediction error. @param share of this sample in the mean; @param weight probability that it is healthy.
  void update(double error, double share, double weight) {
    const double second = error - 2.0 * last_ + before_;
    before_ = last_;
    last_ = error;
    if (++samples_ < 3) return;
    const double most = kLargestRatio * variance();  // one jump counts for no more
    variance_ += weight * std::max(share, 1.0 / samples_) * (std::min(second * second / 6.0, most) - variance_);
  }

  double variance() const { return std::max(variance_, least_); }  ///< of the noise

 private:
  double least_, variance_, last_ = 0.0, before_ = 0.0;
  int samples_ = 0;
};

}  // namespace jackal_aic::faults
