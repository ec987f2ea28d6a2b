#include "jackal_aic/predictive/precision_learning.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kLargestSurprise = 50.0;  // of e^zeta n^2 in one step: one outlier must not make a channel deaf

}  // namespace

LogPrecision::LogPrecision(double variance, double memory)
    : smallest_(variance / kRange), largest_(variance * kRange), memory_(memory), variance_(variance) {}

void LogPrecision::learn(double residual, double hidden, double step) {
  const double surprise = std::min((residual * residual + hidden) / variance_, kLargestSurprise);
  const double change = std::min(step / memory_, 1.0) * (1.0 - surprise);  // of zeta, with kappa = 2/memory
  variance_ = std::clamp(variance_ * std::exp(-change), smallest_, largest_);
}

void SteadyError::start(const WheelBelief& wheel) {
  C_.setZero();
  C_(0, 0) = wheel.parameters().measurement_variance;
  C_since_ = C_;
  speed_ = wheel.speed();
  variance_ = C_(0, 0);
  residual_ = hidden_ = predicted_change_ = predicted_change_variance_ = 0.0;
}

void SteadyError::predict(const WheelBelief& wheel) {
  if (wheel.atLimit()) return;  // there the speed depends on nothing but itself: J = I
  const Eigen::Matrix3d& J = wheel.transition();
  C_ = (J * C_ * J.transpose()).eval();
  C_since_ = (J * C_since_).eval();
}

void SteadyError::correct(const WheelBelief& wheel) {
  predicted_change_ = wheel.predicted() - speed_;
  predicted_change_variance_ = C_(0, 0) + variance_ - 2.0 * C_since_(0, 0);
  const Eigen::Vector3d& gain = wheel.lastGain();
  Eigen::Matrix3d kept = Eigen::Matrix3d::Identity();  // I - K H
  kept.col(0) -= gain;
  const double variance = wheel.parameters().measurement_variance;
  C_ = (kept * C_ * kept.transpose() + variance * gain * gain.transpose()).eval();
  C_since_ = C_;
  speed_ = wheel.speed();
  variance_ = C_(0, 0);
  residual_ = wheel.measurement() - wheel.speed();
  hidden_ = 2.0 * gain(0) * variance - C_(0, 0);
}

SensorPrecisions::SensorPrecisions(const SensorVariances& configured, double memory)
    : wheel_left_(configured.wheel_left, memory),
      wheel_right_(configured.wheel_right, memory),
      gyro_(configured.gyro, memory),
      accelerometer_(configured.accelerometer, memory) {}

void SensorPrecisions::start(const WheelBelief& left, const WheelBelief& right) {
  left_.start(left);
  right_.start(right);
}

void SensorPrecisions::predict(const WheelBelief& left, const WheelBelief& right) {
  left_.predict(left);
  right_.predict(right);
}

void SensorPrecisions::correct(const WheelBelief& left, const WheelBelief& right) {
  left_.correct(left);
  right_.correct(right);
}

void SensorPrecisions::learnWheels(double step) {
  wheel_left_.learn(left_.residual(), left_.hiddenVariance(), step);
  wheel_right_.learn(right_.residual(), right_.hiddenVariance(), step);
}

void SensorPrecisions::learnGyro(double residual, double slope, double track_gain, double step) {
  // The slope, averaged with a gain c, errs by c/(2 - c) Sigma in the channel and contains c of the noise.
  const double slip = (2.0 * track_gain - track_gain / (2.0 - track_gain)) * gyro_.variance();
  const double wheels = slope * slope * (left_.variance() + right_.variance());
  gyro_.learn(residual, slip - wheels, step);
}

void SensorPrecisions::learnAccelerometer(double acceleration, double radius, double step) {
  const double predicted = 0.5 * radius * (left_.predictedChange() + right_.predictedChange()) / step;
  const double per_wheel = 0.5 * radius / step;
  const double wheels = per_wheel * per_wheel * (left_.predictedChangeVariance() + right_.predictedChangeVariance());
  accelerometer_.learn(acceleration - predicted, -wheels, step);
}

SensorVariances SensorPrecisions::variances() const {
  return {wheel_left_.variance(), wheel_right_.variance(), gyro_.variance(), accelerometer_.variance()};
}

}  // namespace jackal_aic
