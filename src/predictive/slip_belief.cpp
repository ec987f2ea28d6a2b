#include "jackal_aic/predictive/slip_belief.hpp"

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/forgetting.hpp"

namespace jackal_aic {
namespace {

constexpr double kDeviation = 0.05;   // of the configured turn, relative: how much it is trusted at first
constexpr double kCertainTurn = 5.0;  // least difference of the wheel speeds to learn from, standard deviations of it
constexpr double kErrorMemory = 1.0;  // over which the error of the believed difference is averaged [s]
constexpr double kUsual = 9.0;        // mean squares of that error, up to which it is the encoders' noise
constexpr double kBodyComes = 2.0;    // deviations of the yaw's delay, in which the body comes after its wheels
constexpr double kStandstill = 0.15;  // wheel speeds below which the robot is taken to rest [rad/s]

/// One step of the natural gradient of 1/2 (y - parameter x)^2 / variance, with a curvature that forgets.
double descend(double parameter, double& curvature, double y, double x, double variance, double forgetting) {
  curvature = curvature * forgetting + x * x / variance;
  return parameter + x * (y - parameter * x) / (variance * curvature);
}

}  // namespace

SlipBelief::SlipBelief(const SlipState& configured, double wheel_radius, const SlipLearning& learning)
    : configured_(configured),
      radius_(wheel_radius),
      learning_(learning),
      turn_(configured.slip_factor / configured.effective_track, learning.range),
      correction_curvature_(1.0 / (kDeviation * kDeviation)),
      kept_{turn_, correction_},
      recent_(kept_) {}

double SlipBelief::boundedCorrection(double correction) const {
  return turn_.bounded(correction * turn_.inPlace()) / turn_.inPlace();  // q = g q_1 stays within the range of q_1
}

void SlipBelief::setState(const SlipState& state) {
  TurnModel turn(configured_.slip_factor / configured_.effective_track, learning_.range);
  if (state.turn) turn.setCoefficients(*state.turn);
  turn_ = turn;
  correction_ = boundedCorrection(state.slip_factor / (state.effective_track * turn_.inPlace()));
  kept_ = recent_ = {turn_, correction_};
}

// ---- the turn

double SlipBelief::yawRate(double left, double right) const {
  return turn_.yawRate(radius_ * (right - left), 0.5 * radius_ * (left + right), correction_);
}

double SlipBelief::usualYawRate(double left, double right) const {
  return turn_.yawRate(radius_ * (right - left), 0.5 * radius_ * (left + right));
}

double SlipBelief::yawPerDifference(double left, double right) const {
  return radius_ * turn_.perDifference(radius_ * (right - left), 0.5 * radius_ * (left + right), correction_);
}

double SlipBelief::yawAcceleration(const WheelVector& speed, const WheelVector& acceleration) const {
  // d theta_dot/dt = g (df/dx dx/dt + df/dv dv/dt)
  const double per_speed = turn_.perSpeed(radius_ * (speed(1) - speed(0)), 0.5 * radius_ * speed.sum());
  return yawPerDifference(speed(0), speed(1)) * (acceleration(1) - acceleration(0)) +
         correction_ * per_speed * 0.5 * radius_ * acceleration.sum();
}

double SlipBelief::wheelDifference(double yaw_rate, double mean) const {
  return turn_.difference(yaw_rate, radius_ * mean, correction_) / radius_;
}

WheelCommand SlipBelief::wheelSpeeds(double forward, double yaw_rate) const {
  const double mean = forward / (radius_ * slipFactor());
  const double half_difference = 0.5 * wheelDifference(yaw_rate, mean);
  return {mean - half_difference, mean + half_difference};
}

bool SlipBelief::turns(const WheelDifference& n, double step) {
  average(error_variance_, n.error * n.error, step, kErrorMemory);
  const double variance = std::max(n.variance, error_variance_);
  return std::abs(n.value) > std::max(learning_.excitation, kCertainTurn * std::sqrt(variance));
}

/// n(t) - n(t - T) of a first-order filter: T dn/dt while the wheels ramp, and fading as the body comes after them.
double SlipBelief::changeOf(const WheelDifference& n, double step) {
  const double T = kBodyComes * learning_.yaw_delay_deviation;
  changed_ = T > 0.0 ? (changed_ + step * n.rate) * std::exp(-step / T) : 0.0;
  return changed_;
}

void SlipBelief::learnTrack(double yaw_rate, const WheelDifference& n, double step) {
  const double left = n.mean - 0.5 * n.value, right = n.mean + 0.5 * n.value;
  const double late = yawPerDifference(left, right) * changeOf(n, step);
  if (!agrees(yaw_rate, radius_ * (n.value + n.error), radius_ * (n.mean + n.mean_error), step)) return;
  keep(n, step);
  learnTurn(yaw_rate, n, learning_.gyro_variance + late * late, step);
  const double slope = yawPerDifference(left, right), f = usualYawRate(left, right);
  // A belief that is off by more than usual may be off by as much as is measured.
  const double surprise = n.error * n.error > kUsual * error_variance_ ? n.error * n.error : 0.0;
  if (!turns(n, step)) return;
  const double variance = learning_.gyro_variance + slope * slope * (n.variance + surprise) + late * late;
  const double forgetting = keptAfter(step, learning_.memory);
  correction_ = boundedCorrection(descend(correction_, correction_curvature_, yaw_rate, f, variance, forgetting));
}

/// In a turn by the mean of a second: single samples of a gyro that is wrong agree by their noise.
bool SlipBelief::agrees(double yaw_rate, double x, double v, double step) {
  if (std::abs(x) <= TurnModel::kTurn) return turn_.plausible(yaw_rate, x, v);
  const double asked = x * configured_.slip_factor / configured_.effective_track;
  agreement_.update(yaw_rate, asked, step);
  return turn_.plausible(agreement_.value() * asked, x, v);
}

void SlipBelief::keep(const WheelDifference& n, double step) {
  if (std::abs(radius_ * n.value) > TurnModel::kTurn) trusted_ += step;
  if (trusted_ < kTrustTime) return;
  kept_ = recent_;
  recent_ = {turn_, correction_};
  trusted_ = 0.0;
}

void SlipBelief::withdraw() {
  turn_ = kept_.turn;
  correction_ = kept_.correction;
  recent_ = kept_;
  trusted_ = 0.0;
}

void SlipBelief::learnTurn(double yaw_rate, const WheelDifference& n, double variance, double step) {
  const double difference = n.value + n.error, mean = n.mean + n.mean_error;
  if (std::abs(mean) + 0.5 * std::abs(difference) < kStandstill) return;
  const double x = radius_ * difference, v = radius_ * mean;
  const double before = turn_.yawRate(x, v);
  const bool turn = std::abs(x) > TurnModel::kTurn;
  turn_.learn(yaw_rate, x, v, variance, step);
  const double after = turn_.yawRate(x, v);
  // What f learns of this turn is taken out of g.
  if (turn && before * after > 0.0) correction_ = boundedCorrection(correction_ * before / after);
}

}  // namespace jackal_aic
