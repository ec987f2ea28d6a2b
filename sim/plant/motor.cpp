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

MotorLoop::MotorLoop(const PlantParameters& parameters, double wheel_radius, double step)
    : parameters_(parameters),
      acceleration_limit_(parameters.acceleration_limit / wheel_radius),
      speed_limit_(parameters.speed_limit / wheel_radius),
      step_(step),
      response_(parameters.motor_lag > 0.0 ? -std::expm1(-step / parameters.motor_lag) : 1.0) {}

double MotorLoop::reference(double command, double speed, double supply) {
  integrate(speed);
  target_ = clampMagnitude(parameters_.wheel_gain * followed(command, speed), speed_limit_ * supply);
  start_speed_ = speed;
  if (parameters_.velocity_loop_stiffness > 0.0) {
    reference_ = target_ + correction_;
    limited_ =
        std::abs(parameters_.velocity_loop_stiffness * (reference_ - speed)) >= parameters_.torque_limit * supply;
    return reference_;
  }
  const double wanted = response_ * (target_ + correction_ - speed);
  const double change = clampMagnitude(wanted, acceleration_limit_ * supply * step_);
  limited_ = change != wanted;
  reference_ = speed + change;
  return reference_;
}

/// The part of a command that the wheel follows.
double MotorLoop::followed(double command, double speed) const {
  if (parameters_.wheel_offset == 0.0 && parameters_.wheel_breakaway == 0.0) return command;
  const bool starts = std::abs(speed) > kStanding || std::abs(command) >= parameters_.wheel_breakaway;
  return starts ? std::copysign(std::max(0.0, std::abs(command) - parameters_.wheel_offset), command) : 0.0;
}

void MotorLoop::integrate(double speed) {
  if (limited_ || (parameters_.velocity_loop_stiffness == 0.0 && std::abs(speed - reference_) > kReached)) return;
  const double mean_speed = 0.5 * (start_speed_ + speed);
  correction_ += parameters_.velocity_loop_integral * step_ * (target_ - mean_speed);
}

}  // namespace jackal_aic::sim
