#include "jackal_aic/faults/yaw_belief.hpp"

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/square.hpp"

namespace jackal_aic {
namespace {

constexpr double kSlipRange = 2.0;         // factor around the given effective track
constexpr double kLargestDeviation = 0.3;  // of s, relative

}  // namespace

YawBelief::YawBelief(double effective_track, const YawBeliefParameters& parameters)
    : parameters_(parameters),
      given_slope_(1.0 / effective_track),
      slope_(given_slope_),
      drift_(square(parameters.slip_drift * given_slope_)),
      largest_slope_variance_(square(kLargestDeviation * given_slope_)) {
  inflate(parameters.bias_deviation);
}

double YawBelief::variance(double x, double x_variance) const {
  return x * x * slope_variance_ + bias_variance_ + parameters_.gyro_variance + slope_ * slope_ * x_variance;
}

bool YawBelief::biasObservable(double x) const {
  const double of_slip = parameters_.slip_deviation * given_slope_ * x;
  return of_slip * of_slip < parameters_.gyro_variance;
}

void YawBelief::correct(double yaw_rate, double x, double x_variance, double noise_factor, bool settled, double step) {
  const double noise = noise_factor * (parameters_.gyro_variance + slope_ * slope_ * x_variance);
  const double error = this->error(yaw_rate, x);
  const double innovation = x * x * slope_variance_ + bias_variance_ + noise;
  if (biasObservable(x)) {
    if (!settled) return;
    // K_β = P_β / (x² P_s + P_β + Σ), which is no mean of less than kErrorTime
    const double gain = std::min(bias_variance_ / innovation, step / (step + kErrorTime));
    bias_ += gain * error;
    bias_variance_ *= 1.0 - gain;
  } else {
    // K_s = x P_s / (x² P_s + P_β + Σ)
    const double gain = x * slope_variance_ / innovation;
    slope_ = std::clamp(slope_ + gain * error, given_slope_ / kSlipRange, given_slope_ * kSlipRange);
    slope_variance_ *= 1.0 - gain * x;
  }
}

void YawBelief::inflate(double bias_deviation) {
  slope_variance_ = kLargestDeviation * given_slope_ * kLargestDeviation * given_slope_;
  bias_variance_ = bias_deviation * bias_deviation;
}

}  // namespace jackal_aic
