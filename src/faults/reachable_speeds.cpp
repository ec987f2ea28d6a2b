#include "jackal_aic/faults/reachable_speeds.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kStep = DriveTrain::kStep;

std::size_t steps(double time) {
  return static_cast<std::size_t>(std::lround(std::clamp(time, 0.0, ReachableSpeeds::kLongestDeadTime) / kStep));
}

Pace paceWith(const PlantModel& model, double wheel_radius, double lag, double limit_factor) {
  Pace pace = paceOf(lag, model.acceleration_limit / wheel_radius, kStep);
  pace.largest_change *= limit_factor;
  return pace;
}

}  // namespace

ReachableSpeeds::ReachableSpeeds(const PlantModel& model, double wheel_radius, const DriveTrainRange& range)
    : gain_(model.gain),
      youngest_(steps(model.dead_time - range.earlier)),
      model_delay_(steps(model.dead_time)),
      oldest_(steps(model.dead_time + range.later)),
      slow_(paceWith(model, wheel_radius, range.longest_lag, range.slowest_acceleration)),
      nominal_pace_(paceWith(model, wheel_radius, model.lag, 1.0)),
      fast_(paceWith(model, wheel_radius, range.shortest_lag, range.fastest_acceleration)) {
  start(0.0);
}

void ReachableSpeeds::start(double speed) {
  commands_.fill(speed / gain_);
  lowest_command_ = highest_command_ = speed / gain_;
  lowest_rate_ = highest_rate_ = 0.0;
  seed(speed);
}

double ReachableSpeeds::command(std::size_t age) const {
  return commands_[(head_ + commands_.size() - age) % commands_.size()];
}

void ReachableSpeeds::updateCommandRange() {
  const double entering = command(youngest_);
  // Looking at all of them is due only when an extreme one has left.
  const double left = command(oldest_ + 1 < commands_.size() ? oldest_ + 1 : oldest_);
  const bool extreme_left = left != command(oldest_) && (left <= lowest_command_ || left >= highest_command_);
  lowest_command_ = std::min(lowest_command_, entering);
  highest_command_ = std::max(highest_command_, entering);
  if (!extreme_left) return;
  lowest_command_ = highest_command_ = entering;
  for (std::size_t age = youngest_ + 1; age <= oldest_; ++age) {
    lowest_command_ = std::min(lowest_command_, command(age));
    highest_command_ = std::max(highest_command_, command(age));
  }
}

void ReachableSpeeds::predict(double command_now) {
  head_ = (head_ + 1) % commands_.size();
  commands_[head_] = command_now;
  updateCommandRange();
  const double lowest = gain_ * lowest_command_, highest = gain_ * highest_command_;
  lowest_rate_ = std::min(0.0, fast_.towards(lowest, high_)) / kStep;
  highest_rate_ = std::max(0.0, fast_.towards(highest, low_)) / kStep;
  low_ += (lowest < low_ ? fast_ : slow_).towards(lowest, low_);
  high_ += (highest > high_ ? fast_ : slow_).towards(highest, high_);
  nominal_ = std::clamp(nominal_ + nominal_pace_.towards(gain_ * command(model_delay_), nominal_), low_, high_);
}

}  // namespace jackal_aic
