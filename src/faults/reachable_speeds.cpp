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
      commands_(steps(model.dead_time - range.earlier), steps(model.dead_time + range.later), kMostSteps),
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
  low_ = std::min(speed, settled(commands_.low()));
  high_ = std::max(speed, settled(commands_.high()));
}

void ReachableSpeeds::predict(double command, std::size_t number, Steps& steps) {
  PerStep lowest, highest;
  commands_.add(dead_zone_.effective(command), number, lowest.data(), highest.data());
  for (std::size_t i = 0; i < number; ++i) steps.acting[i] = commands_.at(model_delay_ + number - 1 - i);
  const Pace slow = slow_, model = nominal_pace_, fast = fast_;
  const double gain = gain_;
  double low = low_, nominal = nominal_, high = high_;
  for (std::size_t i = 0; i < number; ++i) {
    const double r_low = gain * lowest[i], r_high = gain * highest[i];
    steps.lowest_rate[i] = std::min(0.0, fast.towards(r_low, high)) / kStep;
    steps.highest_rate[i] = std::max(0.0, fast.towards(r_high, low)) / kStep;
    low += r_low < low ? fast.towards(r_low, low) : slow.towards(r_low, low);
    high += r_high > high ? fast.towards(r_high, high) : slow.towards(r_high, high);
    nominal = std::min(high, std::max(low, nominal + model.towards(gain * steps.acting[i], nominal)));
  }
  low_ = low;
  nominal_ = nominal;
  high_ = high;
}

}  // namespace jackal_aic
