#include "jackal_aic/model/wheel_belief.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

/// Part of the expected change of its speed that a wheel with a slow motor makes at least, be it expected by the
/// learned limit or by the model's; one that moves less has another reason.
constexpr double kLeastPart = 0.2;

/// P ← J P J' of a symmetric P and a drive train's J, whose last row is (0, 0, 1).
void propagate(const Eigen::Matrix3d& J, Eigen::Matrix3d& P) {
  const Eigen::Matrix<double, 2, 3> JP = J.topRows<2>().lazyProduct(P);
  P.topLeftCorner<2, 2>() = JP.lazyProduct(J.topRows<2>().transpose());
  P.topRightCorner<2, 1>() = JP.col(2);
  P.bottomLeftCorner<1, 2>() = JP.col(2).transpose();
}

constexpr double kLeastLimit = 0.3;   // lambda
constexpr double kLimitMemory = 0.5;  // s at the limit

}  // namespace

WheelBelief::WheelBelief(const PlantModel& model, double wheel_radius, const WheelBeliefParameters& parameters)
    : drive_train_(model, wheel_radius), commands_(model.dead_time), parameters_(parameters) {
  reset(0.0);
}

void WheelBelief::reset(double speed) {
  commands_.fill(speed / drive_train_.gain());
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
  const double largest = limit_share_ * drive_train_.limit() * kStep;
  const auto [change, limited] = drive_train_.step(x_, commands_.step(command), limit_share_);
  rate_ = change / kStep;
  const double beyond = 2.0 * std::abs(change) - largest;
  if (beyond > 0.0) limit_doubt_ += limitDeviation() * beyond;
  ++steps_;
  limited_steps_ = limited ? limited_steps_ + 1 : 0;
  // At the limit the speed does not depend on z and d: J = I.
  if (!limited) propagate(transition(), P_);
  P_(0, 0) += parameters_.speed_process_noise * kStep;
  P_(2, 2) += parameters_.disturbance_process_noise * kStep;
}

double WheelBelief::correct(double measurement, double added_variance) {
  const double timing = parameters_.dead_time_deviation * rate_;
  const double variance = parameters_.measurement_variance + timing * timing + added_variance;
  predicted_ = x_(0);
  const double error = measurement - predicted_, change = predicted_ - corrected_;
  if ((measurement - measured_) * change > kLeastPart * change * change) {
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
  const double most = std::copysign(drive_train_.limit() * time, rate_),
               variance = 2.0 * parameters_.measurement_variance;
  if (moved * most < kLeastPart * most * most) return forgetLimit();
  limit_curvature_ = limit_curvature_ * std::exp(-time / kLimitMemory) + most * most / variance;
  const double deviation = limitDeviation();
  limit_share_ += deviation * deviation * most * (moved - limit_share_ * most) / variance;
  limit_share_ = std::clamp(limit_share_, kLeastLimit, 1.0);
}

Eigen::Vector3d WheelBelief::gain() const {
  return parameters_.learning_rate * P_.col(0) / (P_(0, 0) + parameters_.measurement_variance);
}

}  // namespace jackal_aic
