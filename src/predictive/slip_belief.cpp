#include "jackal_aic/predictive/slip_belief.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kDeviation = 0.05;    // of the configured values, relative: how much they are trusted at first
constexpr double kCertainTurn = 5.0;   // least difference of the wheel speeds to learn from, standard deviations of it
constexpr double kErrorMemory = 1.0;   // over which the error of the believed difference is averaged [s]
constexpr double kWashout = 0.5;       // T of the filter of speed changes [s]
constexpr double kAlphaMemory = 5.0;   // excited time over which alpha is averaged [s]
constexpr double kSpeedChange = 0.1;   // least |r W| to learn alpha from [m/s]
constexpr double kStraight = 0.5;      // largest difference of the wheel speeds while alpha is learned [rad/s]
constexpr double kStandstill = 0.15;   // wheel speeds below which the robot is taken to rest [rad/s]
constexpr double kOffsetMemory = 1.0;  // of the accelerometer's offset [s]

/// One step of the natural gradient of 1/2 (y - parameter x)^2 / variance, with a curvature that forgets.
double descend(double parameter, double& curvature, double y, double x, double variance, double forgetting) {
  curvature = curvature * forgetting + x * x / variance;
  return parameter + x * (y - parameter * x) / (variance * curvature);
}

double curvatureOf(double value) { return 1.0 / (kDeviation * value * kDeviation * value); }

}  // namespace

SlipBelief::SlipBelief(const SlipState& configured, double wheel_radius, const SlipLearning& learning)
    : configured_(configured),
      radius_(wheel_radius),
      learning_(learning),
      ratio_(configured.slip_factor / configured.effective_track),
      alpha_(configured.slip_factor),
      ratio_curvature_(curvatureOf(ratio_)),
      alpha_curvature_(curvatureOf(alpha_)) {}

double SlipBelief::boundedAlpha(double alpha) const {
  return std::clamp(alpha, configured_.slip_factor / kRange, configured_.slip_factor * kRange);
}

double SlipBelief::boundedRatio(double ratio) const {
  const double configured = configured_.slip_factor / configured_.effective_track;
  return std::clamp(ratio, configured / kRange, configured * kRange);
}

void SlipBelief::setState(const SlipState& state) {
  alpha_ = boundedAlpha(state.slip_factor);
  ratio_ = boundedRatio(state.slip_factor / state.effective_track);
}

bool SlipBelief::turns(const WheelDifference& n, double step) {
  error_variance_ += (n.error * n.error - error_variance_) * -std::expm1(-step / kErrorMemory);
  const double variance = std::max(n.variance, error_variance_);
  return std::abs(n.value) > std::max(learning_.excitation, kCertainTurn * std::sqrt(variance));
}

void SlipBelief::learnTrack(double yaw_rate, const WheelDifference& n, double step) {
  track_gain_ = 0.0;
  if (!turns(n, step)) return;
  const double late = learning_.yaw_delay_deviation * ratio_ * radius_ * n.rate;
  const double slope = ratio_ * radius_;
  const double variance = learning_.gyro_variance + slope * slope * n.variance + late * late;
  const double forgetting = std::exp(-std::min(step, learning_.memory) / learning_.memory);
  const double x = radius_ * n.value;
  ratio_ = boundedRatio(descend(ratio_, ratio_curvature_, yaw_rate, x, variance, forgetting));
  track_gain_ = x * x / (variance * ratio_curvature_);
}

void SlipBelief::observeAcceleration(double acceleration, double left, double right, double step) {
  const double mean = 0.5 * (left + right);
  const bool first = !started_ || step > kWashout;
  const double wheel_change = radius_ * (mean - mean_speed_);
  const double body_change = step * (acceleration - offset_);
  mean_speed_ = mean;
  difference_ = right - left;
  step_ = step;
  started_ = true;
  if (first || std::max(std::abs(left), std::abs(right)) < kStandstill) {
    if (!first) offset_ += (acceleration - offset_) * -std::expm1(-step / kOffsetMemory);
    by_wheels_ = by_accelerometer_ = 0.0;
    return;
  }
  const double washout = std::exp(-step / kWashout);
  by_wheels_ = washout * by_wheels_ + wheel_change;
  by_accelerometer_ = washout * by_accelerometer_ + body_change;
}

void SlipBelief::learnAlpha() {
  if (std::abs(by_wheels_) < kSpeedChange || std::abs(difference_) > kStraight) return;
  // The filter makes the errors of A equal over T: as a constant error of that size they are weighted, not as white.
  const double variance = 0.5 * learning_.accelerometer_variance * kWashout * kWashout;
  alpha_ = boundedAlpha(
      descend(alpha_, alpha_curvature_, by_accelerometer_, by_wheels_, variance, std::exp(-step_ / kAlphaMemory)));
}

}  // namespace jackal_aic
