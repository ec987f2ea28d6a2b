#include "jackal_aic/safety/command_limiter.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kRounding = 1e-9;  // of a step, so that a brake of exactly n steps does not take n + 1

double perStep(double bound, double step) { return bound > 0.0 ? bound * step : HUGE_VAL; }

double orElse(double value, double otherwise) { return value > 0.0 ? value : otherwise; }

}  // namespace

CommandLimiter::CommandLimiter(const LimitParameters& limits, const GeometryParameters& geometry, double period)
    : limits_(limits),
      kinematics_(geometry),
      period_(period),
      largest_rise_(perStep(limits.linear_acceleration, period), perStep(limits.angular_acceleration, period)),
      largest_fall_(perStep(orElse(limits.linear_deceleration, limits.linear_acceleration), period),
                    perStep(orElse(limits.angular_deceleration, limits.angular_acceleration), period)) {}

WheelCommand CommandLimiter::drive(const WheelCommand& wanted) {
  const Vector asked = bodyVelocity(wanted);
  if (!asked.allFinite()) return brake(largest_fall_(0) / period_, largest_fall_(1) / period_, HUGE_VAL);
  brake_steps_left_ = 0;
  const Vector error = speedFactor(asked) * asked - body_;
  double factor = 1.0;
  for (int i = 0; i < 2; ++i) {
    if (error(i) != 0.0) factor = std::min(factor, largestChange(i, error(i)) / std::abs(error(i)));
  }
  body_ += factor * error;
  return command();
}

double CommandLimiter::largestChange(int i, double error) const {
  const double rise = largest_rise_(i), fall = largest_fall_(i), speed = std::abs(body_(i));
  if (body_(i) * error >= 0.0) return rise;
  if (std::abs(error) <= speed || fall == rise) return fall;
  // Through zero: the rise has the share of the period that the fall leaves.
  return speed >= fall ? fall : speed + rise * (1.0 - speed / fall);
}

WheelCommand CommandLimiter::brake(double linear, double angular, double longest) {
  const auto time = [](double speed, double deceleration) {
    return deceleration > 0.0 ? std::abs(speed) / deceleration : 0.0;
  };
  const double needed = std::ceil(std::max(time(body_(0), linear), time(body_(1), angular)) / period_ - kRounding);
  const double allowed = std::floor(longest / period_ + kRounding);
  const int steps = static_cast<int>(std::max(1.0, std::min(needed, allowed)));
  brake_steps_left_ = brake_steps_left_ > 0 ? std::min(brake_steps_left_, steps) : steps;
  body_ *= static_cast<double>(brake_steps_left_ - 1) / brake_steps_left_;
  if (--brake_steps_left_ == 0) reset();
  return command();
}

SetPoint CommandLimiter::reachable(const SetPoint& wanted) const {
  const Vector body(wanted.forward, wanted.yaw_rate);
  const Vector bounded = speedFactor(body) * body;
  return {bounded(0), 0.0, bounded(1)};
}

void CommandLimiter::reset() {
  body_.setZero();
  brake_steps_left_ = 0;
}

void CommandLimiter::follow(const WheelCommand& applied) {
  reset();
  body_ = bodyVelocity(applied);
}

CommandLimiter::Vector CommandLimiter::bodyVelocity(const WheelCommand& wheels) const {
  const BodyVector body = kinematics_.bodyVelocity(wheels);
  return {body(kForward), body(kYaw)};
}

double CommandLimiter::speedFactor(const Vector& body) const {
  const WheelCommand wheels = kinematics_.wheelSpeeds(body(0), body(1));
  const double excess =
      std::max({std::abs(body(0)) / limits_.linear_speed, std::abs(body(1)) / limits_.angular_speed,
                std::abs(wheels.left) / limits_.wheel_speed, std::abs(wheels.right) / limits_.wheel_speed});
  return excess > 1.0 ? 1.0 / excess : 1.0;
}

}  // namespace jackal_aic
