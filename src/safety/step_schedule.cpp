#include "jackal_aic/safety/step_schedule.hpp"

#include <algorithm>

namespace jackal_aic {

StepSchedule::StepSchedule(std::int64_t belief_step, int belief_steps_per_action, int most_periods)
    : belief_step_(belief_step), belief_steps_per_action_(belief_steps_per_action), most_periods_(most_periods) {}

void StepSchedule::start(std::int64_t now) {
  started_ = true;
  boundary_ = now;
  belief_steps_done_ = 0;
}

int StepSchedule::beliefStepsDue(std::int64_t now) const {
  if (!started_) return 0;
  const std::int64_t elapsed = std::max<std::int64_t>(0, (now - boundary_) / belief_step_);
  const int until_boundary = static_cast<int>(std::min<std::int64_t>(elapsed, belief_steps_per_action_));
  return std::max(0, until_boundary - belief_steps_done_);
}

int StepSchedule::actionPeriodsDue(std::int64_t expected) {
  const std::int64_t period = belief_step_ * belief_steps_per_action_;
  const std::int64_t due = (expected - boundary_ + period / 16) / period;
  if (!started_ || due <= 0) return 0;
  const std::int64_t run = std::min<std::int64_t>(due, most_periods_);
  dropped_ += static_cast<std::uint64_t>(due - run);
  return static_cast<int>(run);
}

std::int64_t StepSchedule::lastBoundary(std::int64_t now) const {
  const std::int64_t period = belief_step_ * belief_steps_per_action_;
  return boundary_ + (now - boundary_) / period * period;
}

void StepSchedule::actionStepDone(std::int64_t boundary) {
  boundary_ = boundary;
  belief_steps_done_ = 0;
}

}  // namespace jackal_aic
