#include "jackal_aic/faults/reachable_speeds.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

std::size_t steps(double time) {
  return static_cast<std::size_t>(
      std::lround(std::clamp(time, 0.0, ReachableSpeeds::kLongestDeadTime) / DriveTrain::kStep));
}

Pace paceWith(const PlantModel& model, double wheel_radius, double lag, double limit_factor) {
  Pace pace = paceOf(lag, model.acceleration_limit / wheel_radius, DriveTrain::kStep);
  pace.largest_change *= limit_factor;
  return pace;
}

}  // namespace

ReachableSpeeds::ReachableSpeeds(const PlantModel& model, double wheel_radius, const DriveTrainRange& range)
    : gain_(model.gain),
      dead_zone_(model),
      model_delay_(steps(model.dead_time)),
      shortest_delay_(steps(model.dead_time - range.earlier)),
      longest_delay_(steps(model.dead_time + range.later)),
      commands_(longest_delay_),
      slow_(paceWith(model, wheel_radius, range.longest_lag, range.slowest_acceleration)),
      nominal_pace_(paceWith(model, wheel_radius, model.lag, 1.0)),
      fast_(paceWith(model, wheel_radius, range.shortest_lag, range.fastest_acceleration)) {}

void ReachableSpeeds::start(double speed) {
  commands_.fill(speed / gain_);
  seed(speed);
}

void ReachableSpeeds::seed(double speed, double misfit) {
  const auto settled = [&](double command) {
    const double steady = gain_ * command;
    return std::abs(steady - speed) < misfit ? steady : speed;
  };
  nominal_ = speed;
  const Range acting = commands_.range(shortest_delay_, longest_delay_);
  low_ = std::min(speed, settled(acting.low));
  high_ = std::max(speed, settled(acting.high));
}

Range ReachableSpeeds::predict(double command) {
  commands_.add(dead_zone_.effective(command));
  const Range acting = commands_.range(shortest_delay_, longest_delay_);
  const double r_low = gain_ * acting.low, r_high = gain_ * acting.high;
  const Range rates{std::min(0.0, fast_.towards(r_low, high_)) / DriveTrain::kStep,
                    std::max(0.0, fast_.towards(r_high, low_)) / DriveTrain::kStep};
  low_ += (r_low < low_ ? fast_ : slow_).towards(r_low, low_);
  high_ += (r_high > high_ ? fast_ : slow_).towards(r_high, high_);
  nominal_ = std::clamp(nominal_ + nominal_pace_.towards(gain_ * this->acting(), nominal_), low_, high_);
  return rates;
}

}  // namespace jackal_aic
