#include "jackal_aic/aic/action_bound.hpp"

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/robot_range.hpp"

namespace jackal_aic {
namespace {

constexpr double kNoise = 0.3;         // rad/s; of noise and steps of encoders a wheel is never that far behind
constexpr double kAccelerating = 0.2;  // of the limit; a wheel that accelerates less is loaded or drives steadily
constexpr double kLongestSlope = 0.5;  // s
constexpr double kRest = 0.2;          // rad/s
constexpr double kUntilSeen = 0.14;    // s until an acceleration shows in the slope of the samples

std::size_t periodsOf(double time, double period) { return static_cast<std::size_t>(std::lround(time / period)); }

}  // namespace

WheelLateness::WheelLateness(const PlantModel& model, double acceleration, double period)
    : acceleration_(acceleration),
      gain_(model.gain),
      dead_zone_(model),
      delay_(periodsOf(model.dead_time + model.lag, period)),
      commands_(delay_ + 1, 0.0) {}

void WheelLateness::command(double speed) {
  head_ = (head_ + 1) % commands_.size();
  commands_[head_] = gain_ * dead_zone_.effective(speed);
}

void WheelLateness::observe(double stamp, double speed) {
  samples_[count_++ % kSamples] = {stamp, speed};
  const double span = stamp - samples_[count_ % kSamples].stamp;
  const bool known = count_ >= kSamples && span <= kLongestSlope;
  const Line line = known ? measured() : Line{0.0, speed};
  accelerating_ = std::abs(line.slope) < kAccelerating * acceleration_ ? 0 : line.slope > 0.0 ? 1 : -1;
  late_ = accelerating_ * (commandAgo(delay_) - line.speed) > kNoise ? accelerating_ : 0;
}

void WheelLateness::forgetMeasurements() {
  count_ = 0;
  accelerating_ = late_ = 0;
}

void WheelLateness::reset() {
  forgetMeasurements();
  std::fill(commands_.begin(), commands_.end(), 0.0);
}

double WheelLateness::commandAgo(std::size_t periods) const {
  return commands_[(head_ + commands_.size() - periods) % commands_.size()];
}

WheelLateness::Line WheelLateness::measured() const {
  Sample mean;
  for (const Sample& sample : samples_) {
    mean.stamp += sample.stamp / kSamples;
    mean.speed += sample.speed / kSamples;
  }
  double covariance = 0.0, variance = 0.0;
  for (const Sample& sample : samples_) {
    covariance += (sample.stamp - mean.stamp) * (sample.speed - mean.speed);
    variance += (sample.stamp - mean.stamp) * (sample.stamp - mean.stamp);
  }
  const double slope = covariance / variance;
  return {slope, mean.speed + slope * (samples_[(count_ - 1) % kSamples].stamp - mean.stamp)};
}

ActionBound::ActionBound(const std::optional<PlantModel>& model, double wheel_radius, double period) : period_(period) {
  if (!model) return;
  const double acceleration = model->acceleration_limit / wheel_radius;
  gain_ = model->gain;
  dead_zone_ = DeadZone(*model);
  ramp_ = acceleration * period / gain_;
  wheels_.assign(2, WheelLateness(*model, acceleration, period));
}

void ActionBound::observe(const Observation& observation, const ChannelValidity& measured) {
  speed_ << observation.wheel_left, observation.wheel_right;
  if (wheels_.empty()) return;
  if (measured.wheel_left) wheels_[0].observe(observation.stamp, observation.wheel_left);
  if (measured.wheel_right) wheels_[1].observe(observation.stamp, observation.wheel_right);
  if (!measured.wheel_left) wheels_[0].forgetMeasurements();
  if (!measured.wheel_right) wheels_[1].forgetMeasurements();
}

void ActionBound::forgetMeasurements() {
  for (WheelLateness& wheel : wheels_) wheel.forgetMeasurements();
}

void ActionBound::apply(const WheelVector& applied) {
  const WheelVector effective = applied.unaryExpr([this](double u) { return dead_zone_.effective(u); });
  followed_ += (effective - followed_).cwiseMax(-ramp_).cwiseMin(ramp_);
  for (std::size_t i = 0; i < wheels_.size(); ++i) wheels_[i].command(applied(static_cast<Eigen::Index>(i)));
}

WheelVector ActionBound::bound(const WheelVector& action, const WheelVector& wanted, const WheelVector& goal) {
  if (wheels_.empty()) return wanted;
  watchStop(action, goal.isZero(0.0));
  if (goal != goal_) start_ = action;
  goal_ = goal;
  const double part = room(action, wanted - action);
  WheelVector next = wanted;
  if (part < 1.0) next = action + part * (wanted - action);
  watchRamp(part < 1.0);
  const WheelVector steady = (goal / gain_).unaryExpr([this](double v) { return dead_zone_.command(v); });
  if (!told_to_stop_) next = together(action, next, steady);
  for (int i = 0; i < 2; ++i) next(i) = possible(action(i), towardsGoal(i, action(i), next(i), steady(i)), goal(i));
  return next;
}

double ActionBound::towardsGoal(int wheel, double action, double next, double goal) const {
  const WheelLateness& motor = wheels_[static_cast<std::size_t>(wheel)];
  const double speed = gain_ * dead_zone_.effective(goal);
  const bool on_its_way = ramped_ && motor.accelerating() * (speed - speed_(wheel)) > 0.0;
  if (motor.late() != 0 || on_its_way) return std::clamp(next, std::min(action, goal), std::max(action, goal));
  if (told_to_stop_ && speed_(wheel) > kRest) return std::max(next, std::min(action, 0.0));
  if (told_to_stop_ && speed_(wheel) < -kRest) return std::min(next, std::max(action, 0.0));
  return next;
}

/// Within the commands that a robot near its model needs for the goal, or on the way back to them.
double ActionBound::possible(double action, double next, double goal) const {
  const Range commands = withinRange(goal, goal);
  return std::clamp(next, std::min(action, dead_zone_.command(commands.low / gain_)),
                    std::max(action, dead_zone_.command(commands.high / gain_)));
}

void ActionBound::watchStop(const WheelVector& action, bool told_to_stop) {
  const double driven = action.cwiseAbs().maxCoeff(), moving = speed_.cwiseAbs().maxCoeff();
  const bool over = !told_to_stop || std::max(driven, moving) < kRest;
  if (over) {
    stop_change_ = kUnbounded;
  } else if (!told_to_stop_) {
    stop_change_ = std::max(driven, moving) * period_ / kShortestStop;
  }
  told_to_stop_ = told_to_stop;
}

WheelVector ActionBound::together(const WheelVector& action, const WheelVector& next, const WheelVector& goal) const {
  const WheelVector way = goal - start_;
  if (way.cwiseAbs().minCoeff() < kRest) return next;
  WheelVector held = next;
  for (int i = 0; i < 2; ++i) {
    if (wheels_[static_cast<std::size_t>(i)].late() == 0) continue;
    const double part = (next(1 - i) - start_(1 - i)) / way(1 - i), direction = std::copysign(1.0, way(i));
    const double furthest = std::max(direction * action(i), direction * (start_(i) + part * way(i)));
    held(i) = direction * std::min(direction * next(i), furthest);
  }
  return held;
}

void ActionBound::watchRamp(bool bounded) {
  const int seen = static_cast<int>(wheels_[0].delay() + periodsOf(kUntilSeen, period_));
  since_ramp_ = bounded ? 0 : std::min(since_ramp_ + 1, seen + 1);
  const bool accelerating = wheels_[0].accelerating() != 0 || wheels_[1].accelerating() != 0;
  if (bounded) ramped_ = true;
  if (!accelerating && since_ramp_ > seen) ramped_ = false;
}

double ActionBound::room(const WheelVector& action, const WheelVector& change) const {
  double part = 1.0;
  for (int i = 0; i < 2; ++i) {
    // A period later the motor has gone on by its ramp, and the action may lead it by another.
    const double end = dead_zone_.command(followed_(i) + std::copysign(2.0 * ramp_, change(i))) - action(i);
    const double largest = std::min(std::max(0.0, std::copysign(1.0, change(i)) * end), stop_change_);
    if (std::abs(change(i)) > largest) part = std::min(part, largest / std::abs(change(i)));
  }
  return part;
}

void ActionBound::reset() {
  for (WheelLateness& wheel : wheels_) wheel.reset();
  followed_.setZero();
  start_.setZero();
  goal_.setZero();
  ramped_ = false;
  since_ramp_ = 0;
  speed_.setZero();
  told_to_stop_ = true;
  stop_change_ = kUnbounded;
}

}  // namespace jackal_aic
