#include "jackal_aic/certificate/loop_clock.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {

std::vector<std::pair<std::int64_t, LoopEvent>> LoopClock::events(std::int64_t command_late,
                                                                  std::int64_t sample_early) const {
  std::vector<std::pair<std::int64_t, LoopEvent>> events;
  events.reserve(static_cast<std::size_t>(2 * action_steps + sensor_steps + predict_steps + belief_steps));
  const auto period = static_cast<double>(action_steps * action_period);
  const auto every = [&](std::int64_t count, std::int64_t earlier, LoopEvent event) {
    for (std::int64_t i = 1; i <= count; ++i) {
      const double end = period * static_cast<double>(i) / static_cast<double>(count);
      events.emplace_back(std::llround(end) - earlier, event);
    }
  };
  every(sensor_steps, sample_early, LoopEvent::sensor);
  every(predict_steps, 0, LoopEvent::predict);
  every(belief_steps, 0, LoopEvent::belief);
  every(action_steps, 0, LoopEvent::action);
  for (std::int64_t i = 0; command_late > 0 && i < action_steps; ++i) {
    events.emplace_back(i * action_period + command_late, LoopEvent::command_arrives);
  }
  std::sort(events.begin(), events.end());
  return events;
}

}  // namespace jackal_aic
