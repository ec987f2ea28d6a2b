#include "loop_trajectories.hpp"

#include <algorithm>
#include <cmath>

#include "periodic_system.hpp"

namespace jackal_aic {

LoopTrajectories::LoopTrajectories(const LoopClock& clock, const PlantModel& robot, const LoopChange& change,
                                   double longest_phase, int controller_rows, int least_commands)
    : clock_(clock),
      robot_(robot),
      controller_rows_(controller_rows),
      phase_(std::clamp<std::int64_t>(nanoseconds(change.phase), 0, nanoseconds(longest_phase))) {
  const std::int64_t dead_time = std::max<std::int64_t>(0, nanoseconds(robot.dead_time + change.extra_dead_time));
  whole_periods_ = static_cast<int>(dead_time / clock.action_period);
  remainder_ = dead_time % clock.action_period;
  past_commands_ = std::max(whole_periods_ + (remainder_ > 0 ? 1 : 0), least_commands);
  const int size = wheelRow() + 2;
  states_ = Eigen::MatrixXd::Identity(size, size);
}

Eigen::MatrixXd LoopTrajectories::afterOnePeriod() {
  arrived_ = remainder_ == 0;
  std::int64_t now = 0;
  for (const auto& [time, event] : clock_.events(remainder_, phase_)) {
    // A belief sees the wheel through the sensor only: the robot need not be followed up to its steps.
    if (event != LoopEvent::predict && event != LoopEvent::belief) {
      drive(time - now);
      now = time;
    }
    happen(event, time);
  }
  return states_;
}

void LoopTrajectories::happen(LoopEvent event, std::int64_t now) {
  switch (event) {
    case LoopEvent::sensor:
      return measure();
    case LoopEvent::predict:
      return predict(now);
    case LoopEvent::belief:
      return believe();
    case LoopEvent::action:
      return send();
    case LoopEvent::command_arrives:
      arrived_ = true;
      return;
  }
}

/// The wheel follows the command that acts.
void LoopTrajectories::drive(std::int64_t time) {
  if (time == 0) return;
  const auto [entry, is_new] = responses_.try_emplace(time);
  if (is_new) entry->second = driveTrainResponse(robot_, 1e-9 * static_cast<double>(time));
  const int acting = commandRow(arrived_ ? whole_periods_ : whole_periods_ + 1);
  auto wheel = states_.middleRows<2>(wheelRow());
  wheel = (entry->second.transition * wheel + robot_.gain * entry->second.input * states_.row(acting)).eval();
}

/// The commands under way move on by one, and the action changes.
void LoopTrajectories::send() {
  for (int back = past_commands_; back > 0; --back) states_.row(commandRow(back)) = states_.row(commandRow(back - 1));
  act();
  arrived_ = remainder_ == 0;
}

}  // namespace jackal_aic
