#include "jackal_aic/faults/yaw_prediction.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic::faults {

YawPrediction::YawPrediction(const FaultParameters& parameters, double effective_track, bool on_box)
    : parameters_(parameters),
      given_slope_(on_box ? 0.0 : 1.0 / effective_track),
      largest_bias_(parameters.largest_bias),
      noise_(parameters.gyro_variance) {
  theta_ << given_slope_, 0.0, 0.0;
  P_.setZero();
  P_.diagonal() << square(kLargestSlip * given_slope_), square(0.5 * largest_bias_),
      square(kUnlikeTyres * given_slope_);
  restart();
}

void YawPrediction::predict(double x, double x_change, double v_change, double step) {
  const double moved = (std::abs(x_change) + std::abs(v_change)) / kMotionScale;
  P_(0, 0) = std::min(
      P_(0, 0) + square(parameters_.slip_deviation * given_slope_) * moved + square(kSlipDrift * given_slope_) * step,
      square(kLargestSlip * given_slope_));
  P_(1, 1) = std::min(P_(1, 1) + square(kBiasDrift) * step, square(0.5 * largest_bias_));
  const double kept = std::exp(-step / kGroundMemory), s = theta_(0);
  e_.mean *= kept;
  e_.variance = kept * kept * e_.variance + (1.0 - kept * kept) * ground_ + square(kPaceDoubt * s * x_change) +
                square(parameters_.slip_deviation * s * x * v_change / kGrip);
}

double YawPrediction::variance(const Normal& x, double v) const {
  const Eigen::Vector3d h = row(x.mean, v);
  return h.dot(P_ * h) + square(theta_(0)) * x.variance + e_.variance + noise_.variance();
}

void YawPrediction::learn(double yaw_rate, const Normal& x, double v, double step, double healthy, bool ground) {
  const double error = yaw_rate - mean(x.mean, v), S = variance(x, v);
  const double weight = healthy * studentWeight(error * error, S);
  // The slip is not learned from a difference of the wheels that is noise (errors in variables).
  const double seen = square(x.mean) / (square(x.mean) + x.variance + kTiny);
  const Eigen::Vector3d h = row(seen * x.mean, v), Ph = P_ * h;
  theta_ += weight / S * error * Ph;
  P_ -= weight / S * Ph * Ph.transpose();
  P_ = 0.5 * (P_ + P_.transpose().eval());
  theta_(0) = std::clamp(theta_(0), given_slope_ / kSlopeRange, given_slope_ * kSlopeRange);
  theta_(1) = std::clamp(theta_(1), -largest_bias_, largest_bias_);
  theta_(2) = std::clamp(theta_(2), -kVeer * given_slope_, kVeer * given_slope_);
  if (ground) {
    const double gain = weight * e_.variance / S;
    e_.mean += gain * error;
    e_.variance *= 1.0 - gain;
    const double share = -std::expm1(-step / thresholds::kSensorMemory);
    ground_ += healthy * share * (std::min(square(e_.mean), kLargestRatio * ground_) - ground_);
    ground_ = std::max(ground_, square(kGroundDeviation));
  }
  noise_.update(yaw_rate - mean(x.mean, v), -std::expm1(-step / thresholds::kNoiseMemory), healthy);
}

YawPrediction YawPrediction::withOffset(double deviation) const {
  YawPrediction other = *this;
  other.largest_bias_ = 2.0 * deviation;
  other.P_(1, 1) += square(deviation);
  return other;
}

void YawPrediction::mix(const YawPrediction& other, double weight) {
  const double own = 1.0 - weight;
  const Eigen::Vector3d apart = other.theta_ - theta_;
  theta_ += weight * apart;
  P_ = own * P_ + weight * other.P_ + own * weight * apart * apart.transpose();
  const double e = other.e_.mean - e_.mean;
  e_.mean += weight * e;
  e_.variance = own * e_.variance + weight * other.e_.variance + own * weight * square(e);
  ground_ = own * ground_ + weight * other.ground_;
}

}  // namespace jackal_aic::faults
