#include "jackal_aic/safety/command_limiter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace jackal_aic {
namespace {

constexpr double kRounding = 1e-9;  // of a step, so that a brake of exactly n steps does not take n + 1

double perStep(double bound, double step) { return bound > 0.0 ? bound * step : HUGE_VAL; }

double orElse(double value, double otherwise) { return value > 0.0 ? value : otherwise; }

/// Largest change u from which changes that shrink by d each end at an error: error = u + (u - d) + ... in n terms, the
/// last one in [0, d].
double stoppingChange(double error, double d) {
  if (d == HUGE_VAL || error == 0.0) return error;
  const double n = std::ceil(0.5 * (std::sqrt(1.0 + 8.0 * error / d) - 1.0));
  return error / n + 0.5 * d * (n - 1.0);
}

}  // namespace

CommandLimiter::CommandLimiter(const LimitParameters& limits, const GeometryParameters& geometry, double period)
    : limits_(limits),
      kinematics_(geometry),
      period_(period),
      largest_rise_(perStep(limits.linear_acceleration, period), perStep(limits.angular_acceleration, period)),
      largest_fall_(perStep(orElse(limits.linear_deceleration, limits.linear_acceleration), period),
                    perStep(orElse(limits.angular_deceleration, limits.angular_acceleration), period)),
      largest_difference_(perStep(limits.linear_jerk, period * period), perStep(limits.angular_jerk, period * period)) {
}

WheelCommand CommandLimiter::drive(const WheelCommand& wanted, const std::optional<SetPoint>& set_point) {
  const Vector asked = bodyVelocity(wanted);
  if (!asked.allFinite()) return brake(largest_fall_(0) / period_, largest_fall_(1) / period_, HUGE_VAL);
  brake_steps_left_ = 0;
  const Vector error = speedFactor(asked) * asked - body_;
  Vector way = error;
  if (set_point) {
    const SetPoint end = reachable(*set_point);
    way = Vector(end.forward, end.yaw_rate) - body_;
  }
  const Vector step = change(error, way);
  last_change_ = allowedFraction(step) * step;
  body_ += last_change_;
  return command();
}

double CommandLimiter::allowedFraction(const Vector& step) const {
  const WheelCommand wheels = kinematics_.wheelSpeeds(body_(0), body_(1));
  const WheelCommand more = kinematics_.wheelSpeeds(step(0), step(1));
  double factor = 1.0;
  for (const auto& [speed, rise] : {std::pair(wheels.left, more.left), std::pair(wheels.right, more.right)}) {
    const double bound = std::copysign((1.0 + kRounding) * limits_.wheel_speed, rise);
    if (std::abs(speed + rise) > std::abs(bound)) factor = std::min(factor, std::max(0.0, (bound - speed) / rise));
  }
  return factor;
}

CommandLimiter::Vector CommandLimiter::change(const Vector& error, const Vector& way) const {
  Vector separate;
  double factor = 1.0;
  for (int i = 0; i < 2; ++i) {
    separate(i) = separateChange(i, error(i), way(i));
    if (error(i) != 0.0) factor = std::min(factor, std::max(separate(i) / error(i), 0.0));
  }
  const Vector together = factor * error;
  return keepsJerk(together) ? together : separate;
}

double CommandLimiter::separateChange(int i, double error, double way) const {
  const double d = largest_difference_(i), far = std::abs(error);
  // The wanted command continues towards the set point unless it is beyond it, or turns away.
  const double end = error * way > 0.0 ? std::max(far, std::abs(way)) : far;
  const double largest = std::min({far, largestChange(i, error), stoppingChange(end, d)});
  return std::clamp(std::copysign(largest, error), last_change_(i) - d, last_change_(i) + d);
}

double CommandLimiter::largestChange(int i, double error) const {
  const double rise = largest_rise_(i), fall = largest_fall_(i), speed = std::abs(body_(i));
  if (body_(i) * error >= 0.0) return rise;
  if (std::abs(error) <= speed || fall == rise) return fall;
  // Through zero: at most the rise's change is left there.
  const double d = largest_difference_(i);
  if (d == HUGE_VAL) return speed >= fall ? fall : speed + rise * (1.0 - speed / fall);
  return std::min(fall, std::max(rise, std::sqrt(rise * rise + 2.0 * d * std::max(0.0, speed - fall))));
}

bool CommandLimiter::keepsJerk(const Vector& change) const {
  const double slack = 1.0 + kRounding;
  return ((change - last_change_).array().abs() <= slack * largest_difference_.array()).all();
}

WheelCommand CommandLimiter::brake(double linear, double angular, double longest) {
  const auto time = [](double speed, double deceleration) {
    return deceleration > 0.0 ? std::abs(speed) / deceleration : 0.0;
  };
  const double needed = std::ceil(std::max(time(body_(0), linear), time(body_(1), angular)) / period_ - kRounding);
  const double allowed = std::floor(longest / period_ + kRounding);
  const int steps = static_cast<int>(std::max(1.0, std::min(needed, allowed)));
  brake_steps_left_ = brake_steps_left_ > 0 ? std::min(brake_steps_left_, steps) : steps;
  const Vector next = body_ * (static_cast<double>(brake_steps_left_ - 1) / brake_steps_left_);
  last_change_ = next - body_;
  body_ = next;
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
  last_change_.setZero();
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
