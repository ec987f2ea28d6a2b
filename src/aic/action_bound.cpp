#include "jackal_aic/aic/action_bound.hpp"

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/robot_range.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

constexpr double kAccelerating = 0.2;  // of the limit; a wheel that accelerates less drives steadily
constexpr double kMemory = 0.04;       // s, time constant of the measured acceleration

}  // namespace

ActionBound::ActionBound(const PlantModel& model, const GeometryParameters& geometry, double period)
    : period_(period),
      acceleration_(model.acceleration_limit / geometry.wheel_radius),
      gain_(model.gain),
      dead_zone_(model),
      ramp_(acceleration_ * period / gain_),
      sides_(geometry, !model.on_box) {}

void ActionBound::Wheel::observe(double measured_at, double measured) {
  const double time = measured_at - stamp;
  acceleration -= std::expm1(-time / kMemory) * ((measured - speed) / time - acceleration);
  stamp = measured_at;
  speed = measured;
}

void ActionBound::observe(const Observation& observation, const ChannelValidity& measured) {
  if (!measured.wheel_left) wheels_[0] = {};
  if (!measured.wheel_right) wheels_[1] = {};
  sides_.observe(observation, measured);
  wheels_[0].observe(observation.stamp, observation.wheel_left);
  wheels_[1].observe(observation.stamp, observation.wheel_right);
}

void ActionBound::resetMeasurements() {
  wheels_ = {};
  sides_.reset();
}

void ActionBound::apply(const WheelVector& applied) {
  const WheelVector effective = applied.unaryExpr([this](double u) { return dead_zone_.effective(u); });
  followed_ += (effective - followed_).cwiseMax(-ramp_).cwiseMin(ramp_);
}

WheelVector ActionBound::bound(const WheelVector& action, const WheelVector& wanted, const WheelVector& goal) const {
  const bool stop = goal.isZero(0.0);
  const WheelVector at_goal(commandOf(goal(0)), commandOf(goal(1))), way = at_goal - action;
  WheelVector next = followable(action, wanted, stop);
  const WheelVector change = next - action;
  for (int i = 0; i < 2; ++i) {
    const Wheel& wheel = wheels_[static_cast<std::size_t>(i)];
    const bool accelerates = acceleratesTo(goal(i), wheel);
    if (accelerates || (stop && std::abs(wheel.speed) > thresholds::kRest)) {
      const int other = 1 - i;
      const bool together = accelerates && std::abs(way(other)) > thresholds::kRest;
      const double end = action(i) + (together ? std::clamp(change(other) / way(other), 0.0, 1.0) : 1.0) * way(i);
      next(i) = std::clamp(next(i), std::min(action(i), end), std::max(action(i), end));
    }
    // Within the range of a robot near its model for the goal, or returning to it.
    const Range commands = withinRange(goal(i), goal(i));
    next(i) = std::clamp(next(i), std::min(action(i), commandOf(commands.low)),
                         std::max(action(i), commandOf(commands.high)));
  }
  return sides_.bound(action, next, at_goal);
}

bool ActionBound::acceleratesTo(double goal, const Wheel& wheel) const {
  return wheel.acceleration * (goal - wheel.speed) > 0.0 &&
         std::abs(wheel.acceleration) > kAccelerating * acceleration_;
}

WheelVector ActionBound::followable(const WheelVector& action, const WheelVector& wanted, bool stop) const {
  const WheelVector change = wanted - action;
  double largest_fall = std::numeric_limits<double>::infinity();
  if (stop) {
    const double moving = std::max(std::abs(wheels_[0].speed), std::abs(wheels_[1].speed));
    // A motor with an integral in its velocity loop runs back after a faster fall.
    const double fastest = std::max({thresholds::kRest, moving, action.cwiseAbs().maxCoeff()});
    largest_fall = fastest * period_ / thresholds::kPatience;
  }
  double part = 1.0;
  for (int i = 0; i < 2; ++i) {
    // A period later the motor has gone on by its ramp, and the action may lead it by another.
    const double sign = std::copysign(1.0, change(i));
    const double lead = sign * (dead_zone_.command(followed_(i) + sign * 2.0 * ramp_) - action(i));
    const double largest = std::min(std::max(0.0, lead), largest_fall);
    if (std::abs(change(i)) > largest) part = std::min(part, largest / std::abs(change(i)));
  }
  return part < 1.0 ? WheelVector(action + part * change) : wanted;
}

void ActionBound::reset() {
  resetMeasurements();
  followed_.setZero();
}

}  // namespace jackal_aic
