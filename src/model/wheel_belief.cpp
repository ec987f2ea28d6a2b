#include "jackal_aic/model/wheel_belief.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "jackal_aic/model/forgetting.hpp"
#include "jackal_aic/model/square.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

constexpr double kLeastPart = 0.2;             // of the expected change that a slow motor reaches
constexpr double kNoise = 2.0;                 // standard deviations of a measurement; smaller changes are noise
constexpr double kLeastTiming = 0.1;           // lambda_t
constexpr double kMostSurprise = 4.0;          // of epsilon^2/S that lambda_t learns from
constexpr double kTimingCurvature = 1.0;       // of F along ln lambda_t, as it is believed before anything is known
constexpr double kMostTimingCurvature = 20.0;  // with which older accelerations are forgotten
constexpr double kNoTiming = 1e-9;             // (rad/s)^2; a smaller variance of e counts as zero

/// States of the belief: w, z, d, e.
enum State { kSpeed, kCorrection, kDisturbance, kTiming };

}  // namespace

WheelBelief::WheelBelief(const PlantModel& model, double wheel_radius, const WheelBeliefParameters& parameters,
                         double longest_dead_time)
    : drive_train_(model, wheel_radius), dead_zone_(model), commands_(model.dead_time, longest_dead_time) {
  setParameters(parameters);
  reset(0.0);
}

void WheelBelief::setDriveTrain(const PlantModel& model, double wheel_radius) {
  const auto before = static_cast<double>(commands_.delay());
  const double gain = drive_train_.gain();
  drive_train_ = DriveTrain(model, wheel_radius);
  // The effect of the other gain was a disturbance before.
  x_(kDisturbance) -= (drive_train_.gain() - gain) * commands_.acting();
  commands_.setDeadTime(model.dead_time);
  // w is uncertain by its change in the difference of the dead times.
  const double late = (static_cast<double>(commands_.delay()) - before) * kStep * rate_;
  P_(kSpeed, kSpeed) += late * late;
}

void WheelBelief::setParameters(const WheelBeliefParameters& parameters) {
  parameters_ = parameters;
  turning_ = 0.0;
  quiet_ = 0.0;
  timing_decay_ = timingDecay();
  lagging_ = parameters.dead_time_deviation > 0.0 ? -std::expm1(-kStep / parameters.dead_time_deviation) : 1.0;
}

void WheelBelief::setTurning(double share) {
  quiet_ = share * kNoise * std::sqrt(parameters_.measurement_variance);
  if (share != std::exchange(turning_, share)) timing_decay_ = timingDecay();
}

double WheelBelief::timingDecay() const {
  const double straight = parameters_.timing_time_constant,
               turn = std::max(straight, parameters_.turning_time_constant);
  const double T = straight + turning_ * (turn - straight);
  return T > 0.0 ? std::exp(-kStep / T) : 0.0;
}

void WheelBelief::reset(double speed) {
  commands_.fill(speed / drive_train_.gain());
  timing_share_ = 1.0;
  timing_curvature_ = kTimingCurvature;
  restart(speed);
}

void WheelBelief::restart(double speed) {
  x_ << speed, 0.0, 0.0, 0.0;
  P_.setZero();
  P_(kSpeed, kSpeed) = parameters_.measurement_variance;
  P_(kDisturbance, kDisturbance) = parameters_.disturbance_deviation * parameters_.disturbance_deviation;
  lagged_ = corrected_ = measured_ = predicted_ = speed;
  steps_ = limited_steps_ = 0;
  limit_doubt_ = rate_ = 0.0;
  known_command_ = commands_.acting();
  ramp_ = {};
}

void WheelBelief::predictActing(double command) {
  const double largest = drive_train_.limit() * kStep;
  Eigen::Vector3d wheel = x_.head<3>();
  const auto [change, limited] = drive_train_.step(wheel, command);
  x_.head<3>() = wheel;
  rate_ = change / kStep;
  const double beyond = 2.0 * std::abs(change) - largest;
  if (beyond > 0.0) limit_doubt_ += parameters_.limit_deviation * beyond;
  ++steps_;
  limited_steps_ = limited ? limited_steps_ + 1 : 0;
  // At the limit the speed does not depend on z and d: J = I. A wheel with a constant speed for long is not at the
  // limit: z and d are wrong, and are corrected.
  WheelCovariance J = WheelCovariance::Identity();
  if (!limited || stalled()) J.topLeftCorner<3, 3>() = transition();
  J(kTiming, kTiming) = timing_decay_;
  x_(kTiming) *= timing_decay_;
  P_ = (J * P_).eval().lazyProduct(J.transpose()).eval();
  P_(kSpeed, kSpeed) += parameters_.speed_process_noise * kStep;
  P_(kDisturbance, kDisturbance) += parameters_.disturbance_process_noise * kStep;
  // The error of the gain is another disturbance under another command.
  average(known_command_, command, kStep, thresholds::kMotionMemory);
  double& doubt = P_(kDisturbance, kDisturbance);
  doubt = std::max(doubt, square(parameters_.gain_deviation * drive_train_.gain() * (command - known_command_)));
  widenTiming();
}

/// w(t) − w(t − σ_t) of a first-order filter: σ_t dw/dt while w ramps, and no more than it changed. In a turn, where e
/// lasts, without the effect of the encoder's noise through the action.
void WheelBelief::widenTiming() {
  lagged_ += lagging_ * (x_(kSpeed) - lagged_);
  const double change = x_(kSpeed) - lagged_;
  const double least = timing_share_ * (change - std::clamp(change, -quiet_, quiet_));
  double& variance = P_(kTiming, kTiming);
  variance = std::max(variance, least * least);
  if (variance < kNoTiming) resetTiming();
}

void WheelBelief::resetTiming() {
  x_(kTiming) = 0.0;
  P_.row(kTiming).setZero();
  P_.col(kTiming).setZero();
}

double WheelBelief::correct(double measurement, double added_variance) {
  const double variance = parameters_.measurement_variance + added_variance;
  predicted_ = speed();
  const double error = measurement - predicted_, change = predicted_ - corrected_;
  const bool at_limit = limited_steps_ >= steps_;
  if (!at_limit) ramp_ = {};
  if (at_limit) ramp_.add(measurement - measured_, change, static_cast<double>(steps_) * kStep);
  const bool moves = (measurement - measured_) * change > kLeastPart * change * change;
  if (moves) P_(kSpeed, kSpeed) += limit_doubt_ * limit_doubt_;
  measured_ = measurement;
  steps_ = 0;
  limit_doubt_ = 0.0;

  // x ← x − κ_μ (∂²F/∂x²)⁻¹ ∂F/∂x at the prior, where ∂F/∂x = −C' ε_y/Σ and (∂²F/∂x²)⁻¹ C'/Σ = P C'/(C P C' + Σ)
  const WheelState PC = P_.col(kSpeed) + P_.col(kTiming);
  const double of_belief = PC(kSpeed) + PC(kTiming), S = of_belief + variance,
               moved = parameters_.learning_rate * error;
  learnTiming(error * error / S, P_(kTiming, kTiming) / S);
  x_ += moved / S * PC;
  lagged_ += moved / S * PC(kSpeed);  // a correction is not a motion
  P_ -= PC * PC.transpose() / S;
  if (timing_decay_ == 0.0) resetTiming();
  corrected_ = speed();

  const double residual = error - of_belief / S * moved;
  // x − x_prior = P C' moved/S
  return 0.5 * residual * residual / variance + 0.5 * of_belief / S * moved * moved / S;
}

void WheelBelief::Ramp::add(double change, double expected_change, double step) {
  const double kept = keptAfter(step, thresholds::kPatience);
  moved = kept * moved + change * expected_change;
  expected = kept * expected + expected_change * expected_change;
  time += step;
}

bool WheelBelief::stalled() const {
  return ramp_.time > thresholds::kPatience && ramp_.moved < kLeastPart * ramp_.expected;
}

void WheelBelief::learnTiming(double surprise, double part) {
  if (timing_decay_ == 0.0 || part == 0.0) return;
  // With S = Σ + λ² q: ∂F/∂(ln λ) = part (1 − surprise) of F = ½ ε²/S + ½ ln S, and its curvature is 2 part² on
  // average.
  timing_curvature_ = std::min(timing_curvature_ + 2.0 * part * part, kMostTimingCurvature);
  timing_share_ *= std::exp(-part * (1.0 - std::min(surprise, kMostSurprise)) / timing_curvature_);
  timing_share_ = std::clamp(timing_share_, kLeastTiming, 1.0);
}

Eigen::Vector3d WheelBelief::gain() const {
  return parameters_.learning_rate * P_.col(kSpeed).head<3>() / (P_(kSpeed, kSpeed) + parameters_.measurement_variance);
}

}  // namespace jackal_aic
