#include "jackal_aic/action_bound.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kNoise = 0.3;  // rad/s; of noise and steps of encoders a wheel is never that far behind
constexpr double kAccelerating =
    0.2;  // of the limit; a wheel behind that accelerates less is not at a limit, but loaded
constexpr double kProportional = 0.3;  // part by which a wheel may be less steep than its command, as with another gain
constexpr std::size_t kUncertainty = 2;  // periods by which the hold and the age of a measurement may delay a wheel
constexpr double kLongestSlope = 0.5;    // s
constexpr double kRest = 0.2;            // rad/s

std::size_t periodsOf(double time, double period) { return static_cast<std::size_t>(std::lround(time / period)); }

}  // namespace

WheelLateness::WheelLateness(const PlantModel& model, double acceleration, double period)
    : acceleration_(acceleration),
      gain_(model.gain),
      period_(period),
      delay_(periodsOf(model.dead_time + model.lag, period)),
      commands_(delay_ + kUncertainty + periodsOf(kLongestSlope, period) + 2, 0.0) {}

void WheelLateness::command(double speed) {
  head_ = (head_ + 1) % commands_.size();
  commands_[head_] = gain_ * speed;
}

void WheelLateness::observe(double stamp, double speed) {
  samples_[count_++ % kSamples] = {stamp, speed};
  const double span = stamp - samples_[count_ % kSamples].stamp;
  late_ = count_ >= kSamples && span <= kLongestSlope ? direction(measured(), span) : 0;
}

void WheelLateness::forgetMeasurements() {
  count_ = 0;
  late_ = 0;
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

int WheelLateness::direction(const Line& line, double span) const {
  const int sign = line.slope > 0.0 ? 1 : -1;
  if (sign * line.slope < kAccelerating * acceleration_) return 0;
  if (late_ == sign) return sign * (commandAgo(delay_) - line.speed) > kNoise ? sign : 0;  // until it is there
  return followed(line, sign, std::max<std::size_t>(1, periodsOf(span, period_))) ? 0 : sign;
}

bool WheelLateness::followed(const Line& line, int sign, std::size_t periods) const {
  // Late is what is behind each command that may act now, and as steep as none that may have acted meanwhile.
  for (std::size_t ago = delay_; ago <= delay_ + kUncertainty; ++ago) {
    if (sign * (commandAgo(ago) - line.speed) < kNoise) return true;
    const double slope = (commandAgo(ago) - commandAgo(ago + periods)) / (static_cast<double>(periods) * period_);
    if (std::abs(slope - line.slope) < kProportional * std::abs(slope)) return true;
  }
  return false;
}

ActionBound::ActionBound(const std::optional<PlantModel>& model, double wheel_radius, double period) : period_(period) {
  if (!model) return;
  const double acceleration = model->acceleration_limit / wheel_radius;
  gain_ = model->gain;
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
  followed_ += (applied - followed_).cwiseMax(-ramp_).cwiseMin(ramp_);
  for (std::size_t i = 0; i < wheels_.size(); ++i) wheels_[i].command(applied(static_cast<Eigen::Index>(i)));
}

WheelVector ActionBound::bound(const WheelVector& action, const WheelVector& wanted, const WheelVector& goal) {
  if (wheels_.empty()) return wanted;
  watchStop(action, goal.isZero(0.0));
  const double part = room(action, wanted - action);
  WheelVector next = wanted;
  if (part < 1.0) next = action + part * (wanted - action);
  for (int i = 0; i < 2; ++i) next(i) = towardsGoal(i, action(i), next(i), goal(i) / gain_);
  return next;
}

double ActionBound::towardsGoal(int wheel, double action, double next, double goal) const {
  const bool late = wheels_[static_cast<std::size_t>(wheel)].late() != 0;
  if (late) return std::clamp(next, std::min(action, goal), std::max(action, goal));
  if (told_to_stop_ && speed_(wheel) > kRest) return std::max(next, std::min(action, 0.0));
  if (told_to_stop_ && speed_(wheel) < -kRest) return std::min(next, std::max(action, 0.0));
  return next;
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

double ActionBound::room(const WheelVector& action, const WheelVector& change) const {
  double part = 1.0;
  for (int i = 0; i < 2; ++i) {
    // A period later the motor has gone on by its ramp, and the action may lead it by another.
    const double end = followed_(i) + std::copysign(2.0 * ramp_, change(i)) - action(i);
    const double largest = std::min(std::max(0.0, std::copysign(1.0, change(i)) * end), stop_change_);
    if (std::abs(change(i)) > largest) part = std::min(part, largest / std::abs(change(i)));
  }
  return part;
}

void ActionBound::reset() {
  for (WheelLateness& wheel : wheels_) wheel.reset();
  followed_.setZero();
  speed_.setZero();
  told_to_stop_ = true;
  stop_change_ = kUnbounded;
}

}  // namespace jackal_aic
