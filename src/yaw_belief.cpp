#include "jackal_aic/yaw_belief.hpp"

#include <algorithm>

namespace jackal_aic {
namespace {

constexpr double kSlipRange = 2.0;         // factor around the given effective track
constexpr double kLargestDeviation = 0.3;  // of s, relative
constexpr double kBiasDrift = 1e-3;        // of beta after a second [rad/s]

}  // namespace

YawBelief::YawBelief(double effective_track, const YawBeliefParameters& parameters)
    : parameters_(parameters), given_slope_(1.0 / effective_track), belief_(given_slope_, 0.0) {
  loosen(parameters.bias_deviation);
}

void YawBelief::predict(double recent_change, double memory, double step) {
  const double moved = parameters_.slip_deviation * given_slope_ * recent_change;
  const double drifted = parameters_.slip_drift * given_slope_;
  const double largest = kLargestDeviation * given_slope_;
  P_(0, 0) = std::min(P_(0, 0) + (moved * moved / memory + drifted * drifted) * step, largest * largest);
  P_(1, 1) += kBiasDrift * kBiasDrift * step;
}

double YawBelief::variance(double x, double x_variance) const {
  const Eigen::Vector2d H(x, 1.0);
  return H.dot(P_ * H) + parameters_.gyro_variance + belief_(0) * belief_(0) * x_variance;
}

void YawBelief::correct(double yaw_rate, double x, double x_variance, double noise_factor) {
  const Eigen::Vector2d H(x, 1.0);
  const double noise = parameters_.gyro_variance + belief_(0) * belief_(0) * x_variance;
  const Eigen::Vector2d gain = P_ * H / (H.dot(P_ * H) + noise_factor * noise);
  belief_ += gain * error(yaw_rate, x);
  belief_(0) = std::clamp(belief_(0), given_slope_ / kSlipRange, given_slope_ * kSlipRange);
  P_ = (P_ - gain * H.transpose() * P_).eval();
  P_ = (0.5 * (P_ + P_.transpose())).eval();
}

void YawBelief::loosen(double bias_deviation) {
  const double slip = kLargestDeviation * given_slope_;
  P_ << slip * slip, 0.0, 0.0, bias_deviation * bias_deviation;
}

}  // namespace jackal_aic
