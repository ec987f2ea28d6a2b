#include "jackal_aic/predictive/slip_belief.hpp"

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/forgetting.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

constexpr double kCertainTurn = 5.0;  // least difference of the wheel speeds to learn from, standard deviations of it
constexpr double kDelayDeviations = 2.0;  // deviations of the yaw's delay, by which the body may follow late

}  // namespace

SlipBelief::SlipBelief(const SlipState& configured, double wheel_radius, const SlipLearning& learning)
    : configured_(configured),
      radius_(wheel_radius),
      learning_(learning),
      turn_(configured.slip_factor / configured.effective_track, learning.range),
      kept_(turn_),
      recent_(turn_) {}

void SlipBelief::setState(const SlipState& state) {
  TurnModel turn(configured_.slip_factor / configured_.effective_track, learning_.range);
  TurnCoefficients coefficients = state.turn.value_or(turn.coefficients());
  if (!state.turn) coefficients.mean(0) = state.slip_factor / state.effective_track;
  turn.setCoefficients(coefficients);
  kept_ = recent_ = turn_ = turn;
}

// ---- the turn

double SlipBelief::yawRate(double left, double right) const {
  return turn_.yawRate(radius_ * (right - left), 0.5 * radius_ * (left + right));
}

double SlipBelief::usualYawRate(double left, double right) const {
  return turn_.usualYawRate(radius_ * (right - left), 0.5 * radius_ * (left + right));
}

double SlipBelief::yawPerDifference(double left, double right) const {
  return radius_ * turn_.perDifference(radius_ * (right - left), 0.5 * radius_ * (left + right));
}

double SlipBelief::yawAcceleration(const WheelVector& speed, const WheelVector& acceleration) const {
  // d theta_dot/dt = (d theta_dot/dx) dx/dt + (d theta_dot/dv) dv/dt
  const double per_speed = turn_.perSpeed(radius_ * (speed(1) - speed(0)), 0.5 * radius_ * speed.sum());
  return yawPerDifference(speed(0), speed(1)) * (acceleration(1) - acceleration(0)) +
         per_speed * 0.5 * radius_ * acceleration.sum();
}

double SlipBelief::wheelDifference(double yaw_rate, double mean) const {
  return turn_.difference(yaw_rate, radius_ * mean) / radius_;
}

WheelCommand SlipBelief::wheelSpeeds(double forward, double yaw_rate) const {
  const double mean = forward / (radius_ * slipFactor());
  const double half_difference = 0.5 * wheelDifference(yaw_rate, mean);
  return {mean - half_difference, mean + half_difference};
}

double SlipBelief::uncertainty(const WheelDifference& n) const { return std::max(n.variance, error_variance_); }

bool SlipBelief::turns(const WheelDifference& n, double step) {
  average(error_variance_, n.error * n.error, step, thresholds::kNoiseMemory);
  // A turn that only the model has, or only the encoders, is a late wheel or noise.
  const double least = std::min(std::abs(n.value), std::abs(n.value + n.error));
  return least > std::max(learning_.excitation, kCertainTurn * std::sqrt(uncertainty(n)));
}

/// n(t) - n(t - T) of a first-order filter: T dn/dt while the wheels ramp, and fading as the body follows them.
double SlipBelief::changeOf(const WheelDifference& n, double step) {
  const double T = kDelayDeviations * learning_.yaw_delay_deviation;
  changed_ = T > 0.0 ? (changed_ + step * n.rate) * std::exp(-step / T) : 0.0;
  return changed_;
}

void SlipBelief::learnTrack(double yaw_rate, double lateral, const WheelDifference& n, double step) {
  turn_.pass(step);
  const double left = n.mean - 0.5 * n.value, right = n.mean + 0.5 * n.value;
  const double slope = yawPerDifference(left, right), late = slope * changeOf(n, step);
  const double lasts = std::max(1.0, learning_.yaw_delay_deviation / step);  // samples with the same delay
  const double x = radius_ * (n.value + n.error), v = radius_ * (n.mean + n.mean_error);
  if (!agrees(yaw_rate, lateral, x, v, step)) return;
  keep(n, step);
  const bool turn = turns(n, step);
  const double variance = learning_.gyro_variance + slope * slope * uncertainty(n) + lasts * late * late;
  const double error = turn_.error(yaw_rate, x, v);
  if (turn) {
    turn_.learn(error, radius_ * n.value, radius_ * n.mean, variance, step);
  } else {
    turn_.learnVeer(error, x, v, variance, step);
  }
}

/// In a turn the mean of a second decides, because single samples of a wrong gyro agree by their noise.
bool SlipBelief::agrees(double yaw_rate, double lateral, double x, double v, double step) {
  if (std::abs(x) <= TurnModel::kTurn) return turn_.plausible(yaw_rate, x, v);
  const double asked = x * configured_.slip_factor / configured_.effective_track;
  agreement_.update(yaw_rate, asked, step);
  lateral_.update(lateral, v * asked, step);
  arc_.update(v * yaw_rate, v * asked, step);
  const bool arc = std::abs(v * asked) > TurnAgreement::kLeastTurn;
  const double least = lateral_.value() - thresholds::kSure * lateral_.deviation();
  if (arc && least > learning_.range * arc_.value()) return withdraw(), false;
  return turn_.plausible(agreement_.value() * asked, x, v);
}

void SlipBelief::keep(const WheelDifference& n, double step) {
  if (std::abs(radius_ * n.value) > TurnModel::kTurn) trusted_ += step;
  if (trusted_ < kTrustTime) return;
  kept_ = recent_;
  recent_ = turn_;
  trusted_ = 0.0;
}

void SlipBelief::withdraw() {
  turn_ = recent_ = kept_;
  trusted_ = 0.0;
}

}  // namespace jackal_aic
