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
      dead_zone_(model),
      model_delay_(steps(model.dead_time)),
      commands_(steps(model.dead_time - range.earlier), steps(model.dead_time + range.later)),
      slow_(paceWith(model, wheel_radius, range.longest_lag, range.slowest_acceleration)),
      nominal_pace_(paceWith(model, wheel_radius, model.lag, 1.0)),
      fast_(paceWith(model, wheel_radius, range.shortest_lag, range.fastest_acceleration)) {}

void ReachableSpeeds::start(double speed) {
  commands_.fill(speed / gain_);
  seed(speed);
}

void ReachableSpeeds::predict(double command) {
  commands_.add(dead_zone_.effective(command));
  acting_ = commands_.at(model_delay_);
  const double lowest = gain_ * commands_.low(), highest = gain_ * commands_.high();
  lowest_rate_ = std::min(0.0, fast_.towards(lowest, high_)) / kStep;
  highest_rate_ = std::max(0.0, fast_.towards(highest, low_)) / kStep;
  low_ += (lowest < low_ ? fast_ : slow_).towards(lowest, low_);
  high_ += (highest > high_ ? fast_ : slow_).towards(highest, high_);
  nominal_ = std::clamp(nominal_ + nominal_pace_.towards(gain_ * acting_, nominal_), low_, high_);
}

}  // namespace jackal_aic
