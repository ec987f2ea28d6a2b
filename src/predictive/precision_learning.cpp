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

SensorPrecisions::SensorPrecisions(const SensorVariances& configured, double memory)
    : wheel_left_(configured.wheel_left, memory),
      wheel_right_(configured.wheel_right, memory),
      gyro_(configured.gyro, memory),
      accelerometer_(configured.accelerometer, memory) {}

void SensorPrecisions::learnWheels(const WheelBelief& left, const WheelBelief& right, double step) {
  wheel_left_.learn(left.residual(), left.hiddenVariance(), step);
  wheel_right_.learn(right.residual(), right.hiddenVariance(), step);
}

void SensorPrecisions::learnGyro(double residual, const WheelBelief& left, const WheelBelief& right, double slope,
                                 double track_gain, double step) {
  // The slope, averaged with a gain c, errs by c/(2 - c) Sigma in the channel and contains c of the noise.
  const double slip = (2.0 * track_gain - track_gain / (2.0 - track_gain)) * gyro_.variance();
  const double wheels = slope * slope * (left.steadyVariance() + right.steadyVariance());
  gyro_.learn(residual, slip - wheels, step);
}

void SensorPrecisions::learnAccelerometer(double residual, const WheelBelief& left, const WheelBelief& right,
                                          double radius, double step) {
  const double per_wheel = 0.5 * radius / step;
  const double wheels = per_wheel * per_wheel * (left.predictedChangeVariance() + right.predictedChangeVariance());
  accelerometer_.learn(residual, -wheels, step);
}

SensorVariances SensorPrecisions::variances() const {
  return {wheel_left_.variance(), wheel_right_.variance(), gyro_.variance(), accelerometer_.variance()};
}

}  // namespace jackal_aic
