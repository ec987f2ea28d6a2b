#include "jackal_aic/faults/reachable_speeds.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {

ReachableSpeeds::ReachableSpeeds(const PlantModel& model, double wheel_radius, const DriveTrainRange& range)
    : gain_(model.gain),
      dead_zone_(model),
      model_delay_(CommandsUnderWay::stepsOf(model.dead_time)),
      shortest_delay_(CommandsUnderWay::stepsOf(model.dead_time - range.earlier)),
      commands_(model.dead_time + range.later, model.dead_time + range.later) {
  const auto pace = [limit = model.acceleration_limit / wheel_radius](double lag, double factor) {
    return paceOf(lag, factor * limit, DriveTrain::kStep);
  };
  slow_ = pace(range.longest_lag, range.slowest_acceleration);
  nominal_pace_ = pace(model.lag, 1.0);
  fast_ = pace(range.shortest_lag, range.fastest_acceleration);
}

void ReachableSpeeds::start(double speed) {
  commands_.fill(speed / gain_);
  seed(speed);
}

void ReachableSpeeds::seed(double speed, double misfit) {
  const auto settled = [&](double steady) { return std::abs(steady - speed) < misfit ? steady : speed; };
  nominal_ = speed;
  const Range possible = reference();
  low_ = std::min(speed, settled(possible.low));
  high_ = std::max(speed, settled(possible.high));
}

/// Speeds r to which commands within the range of dead times lead [rad/s].
Range ReachableSpeeds::reference() const {
  double low = commands_.at(shortest_delay_), high = low;
  for (std::size_t age = shortest_delay_ + 1; age <= commands_.delay(); ++age) {
    low = std::min(low, commands_.at(age));
    high = std::max(high, commands_.at(age));
  }
  return {gain_ * low, gain_ * high};
}

Range ReachableSpeeds::predict(double command) {
  commands_.step(dead_zone_.effective(command));
  const auto [r_low, r_high] = reference();
  const Range rates{std::min(0.0, fast_.towards(r_low, high_)) / DriveTrain::kStep,
                    std::max(0.0, fast_.towards(r_high, low_)) / DriveTrain::kStep};
  low_ += (r_low < low_ ? fast_ : slow_).towards(r_low, low_);
  high_ += (r_high > high_ ? fast_ : slow_).towards(r_high, high_);
  nominal_ = std::clamp(nominal_ + nominal_pace_.towards(gain_ * this->acting(), nominal_), low_, high_);
  return rates;
}

}  // namespace jackal_aic
