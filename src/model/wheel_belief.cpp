#include "jackal_aic/model/wheel_belief.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

/// Part of the predicted change of its speed that a wheel with a slow motor makes at least; one that moves less has
/// another reason.
constexpr double kAccelerating = 0.2;

constexpr double kLeastLimit = 0.3;   // lambda
constexpr double kLeastRamp = 0.2;    // part of the model's ramp below which a wheel does not ramp at all
constexpr double kLimitMemory = 0.5;  // s at the limit

}  // namespace

WheelBelief::WheelBelief(const PlantModel& model, double wheel_radius, const WheelBeliefParameters& parameters)
    : model_(model),
      parameters_(parameters),
      limit_(model.acceleration_limit / wheel_radius),
      delay_(static_cast<std::size_t>(std::lround(std::min(model.dead_time, kLongestDeadTime) / kStep))) {
  const double response = model.lag > 0.0 ? -std::expm1(-kStep / model.lag) : 1.0;  // part of an error gone in a step
  const double k = model.velocity_loop_integral * kStep;
  // w ← w + ρ (r + z − w), z ← z + k (r − w − ½ρ (r + z − w)), d ← d
  const Eigen::Vector3d of_r(response, k * (1.0 - 0.5 * response), 0.0);
  transition_ << 1.0 - response, response, of_r(0),                    //
      -k * (1.0 - 0.5 * response), 1.0 - 0.5 * k * response, of_r(1),  //
      0.0, 0.0, 1.0;
  input_ = model.gain * of_r;
  reset(0.0);
}

void WheelBelief::reset(double speed) {
  commands_.fill(speed / model_.gain);
  limit_share_ = 1.0;
  limit_curvature_ = 0.0;
  seed(speed);
}

void WheelBelief::seed(double speed) {
  x_ << speed, 0.0, 0.0;
  P_.setZero();
  P_(0, 0) = parameters_.measurement_variance;
  P_(2, 2) = parameters_.disturbance_deviation * parameters_.disturbance_deviation;
  gain_.setZero();
  corrected_ = measured_ = predicted_ = speed;
  steps_ = limited_steps_ = 0;
  limit_doubt_ = rate_ = 0.0;
}

void WheelBelief::predict(double command) {
  commands_[head_] = command;
  const double u = commands_[(head_ + commands_.size() - delay_) % commands_.size()];
  head_ = (head_ + 1) % commands_.size();

  const Eigen::Vector3d next = transition_ * x_ + input_ * u;
  const double wanted = next(0) - x_(0);
  const double largest = limit_share_ * limit_ * kStep;
  const double change = std::clamp(wanted, -largest, largest);
  rate_ = change / kStep;
  limit_doubt_ += limitDeviation() * std::max(0.0, 2.0 * std::abs(change) - largest);
  ++steps_;
  limited_steps_ = change == wanted ? 0 : limited_steps_ + 1;
  if (change == wanted) {
    x_ = next;
    P_ = (transition_ * P_ * transition_.transpose()).eval();
  } else {  // at the limit the speed no longer depends on z and d, and z rests: J = I
    x_(0) += change;
  }
  P_(0, 0) += parameters_.speed_process_noise * kStep;
  P_(2, 2) += parameters_.disturbance_process_noise * kStep;
}

double WheelBelief::correct(double measurement, double added_variance) {
  const double timing = parameters_.dead_time_deviation * rate_;
  const double variance = parameters_.measurement_variance + timing * timing + added_variance;
  predicted_ = x_(0);
  const double error = measurement - predicted_, change = predicted_ - corrected_;
  if ((measurement - measured_) * change > kAccelerating * change * change) {
    P_(0, 0) += limit_doubt_ * limit_doubt_;
    learnLimit(measurement - measured_);
  } else if (limited_steps_ >= 2 * steps_) {
    forgetLimit();
  }
  measured_ = measurement;
  steps_ = 0;
  limit_doubt_ = 0.0;

  // x ← x − κ_μ (∂²F/∂x²)⁻¹ ∂F/∂x at the prior, where ∂F/∂x = −C' ε_y/Σ and (∂²F/∂x²)⁻¹ C'/Σ = P C'/(C P C' + Σ)
  const Eigen::Vector3d gain = P_.col(0) / (P_(0, 0) + variance);
  const Eigen::Vector3d step = parameters_.learning_rate * error * gain;
  x_ += step;
  P_ = (P_ - gain * P_.row(0)).eval();
  P_ = (0.5 * (P_ + P_.transpose())).eval();
  gain_ = parameters_.learning_rate * gain;
  corrected_ = x_(0);

  const double residual = measurement - x_(0);
  const double moved = parameters_.learning_rate * error;  // x − x_prior = P C' moved/(C P C' + Σ)
  const double innovation_variance = variance / (1.0 - gain(0));
  return 0.5 * residual * residual / variance + 0.5 * gain(0) * moved * moved / innovation_variance;
}

double WheelBelief::limitDeviation() const {
  const double prior = parameters_.limit_deviation;
  return prior > 0.0 ? 1.0 / std::sqrt(1.0 / (prior * prior) + limit_curvature_) : 0.0;
}

/// It does not ramp although it should: what the belief expects of it is wrong, not its motor slow. A limit learned
/// before would keep the belief on its way for ever, and hide from it that the disturbance is wrong.
void WheelBelief::forgetLimit() {
  limit_curvature_ = 0.0;
  limit_share_ = 1.0;
}

void WheelBelief::learnLimit(double moved) {
  if (parameters_.limit_deviation <= 0.0 || steps_ == 0 || limited_steps_ < 2 * steps_) return;
  // λ ← λ − (∂²F/∂λ²)⁻¹ ∂F/∂λ
  const double time = static_cast<double>(steps_) * kStep;
  const double most = std::copysign(limit_ * time, rate_), variance = 2.0 * parameters_.measurement_variance;
  if (moved * most < kLeastRamp * most * most) return forgetLimit();
  limit_curvature_ = limit_curvature_ * std::exp(-time / kLimitMemory) + most * most / variance;
  const double deviation = limitDeviation();
  limit_share_ += deviation * deviation * most * (moved - limit_share_ * most) / variance;
  limit_share_ = std::clamp(limit_share_, kLeastLimit, 1.0);
}

Eigen::Vector3d WheelBelief::gain() const {
  return parameters_.learning_rate * P_.col(0) / (P_(0, 0) + parameters_.measurement_variance);
}

}  // namespace jackal_aic
