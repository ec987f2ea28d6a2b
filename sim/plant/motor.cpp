#include "motor.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic::sim {
namespace {

/// A wheel further than this from its reference after a step [rad/s] was held back by the torque limit.
constexpr double kReached = 1e-6;

/// A wheel slower than this stands [rad/s].
constexpr double kStanding = 0.02;

double clampMagnitude(double value, double limit) { return std::clamp(value, -limit, limit); }

}  // namespace

CommandDelay::CommandDelay(double dead_time, double step) : delay_(std::llround(dead_time / step)) {}

void CommandDelay::push(std::int64_t step, const WheelCommand& command, std::int64_t underway) {
  std::int64_t first = step + delay_ + underway;
  if (!pending_.empty()) first = std::max(first, pending_.back().first);
  if (!pending_.empty() && pending_.back().first == first) {
    pending_.back().second = command;
  } else {
    pending_.emplace_back(first, command);
  }
}

const WheelCommand& CommandDelay::acting(std::int64_t step) {
  while (!pending_.empty() && pending_.front().first <= step) {
    acting_ = pending_.front().second;
    pending_.pop_front();
  }
  return acting_;
}

MotorLoop::MotorLoop(const MotorParameters& parameters, double step)
    : parameters_(parameters),
      step_(step),
      response_(parameters.lag > 0.0 ? -std::expm1(-step / parameters.lag) : 1.0) {}

double MotorLoop::reference(double command, double speed, double supply) {
  integrate(speed);
  target_ = clampMagnitude(parameters_.gain * followed(command, speed), parameters_.speed_limit * supply);
  start_speed_ = speed;
  if (parameters_.stiffness > 0.0) {
    reference_ = target_ + correction_;
    limited_ = std::abs(parameters_.stiffness * (reference_ - speed)) >= parameters_.torque_limit * supply;
    return reference_;
  }
  const double wanted = response_ * (target_ + correction_ - speed);
  const double change = clampMagnitude(wanted, parameters_.acceleration_limit * supply * step_);
  limited_ = change != wanted;
  reference_ = speed + change;
  return reference_;
}

/// The part of a command that the wheel follows.
double MotorLoop::followed(double command, double speed) const {
  if (parameters_.offset == 0.0 && parameters_.breakaway == 0.0) return command;
  const bool starts = std::abs(speed) > kStanding || std::abs(command) >= parameters_.breakaway;
  return starts ? std::copysign(std::max(0.0, std::abs(command) - parameters_.offset), command) : 0.0;
}

void MotorLoop::integrate(double speed) {
  if (limited_ || (parameters_.stiffness == 0.0 && std::abs(speed - reference_) > kReached)) return;
  const double mean_speed = 0.5 * (start_speed_ + speed);
  correction_ += parameters_.integral * step_ * (target_ - mean_speed);
}

}  // namespace jackal_aic::sim
