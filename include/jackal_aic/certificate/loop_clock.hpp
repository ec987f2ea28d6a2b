#pragma once

/// @file
/// Times of sensor, belief and action in a sampled loop.

#include <cstdint>
#include <utility>
#include <vector>

namespace jackal_aic {

/// Events of a period, in their order at equal times.
enum class LoopEvent { sensor, predict, belief, action, command_arrives };

/// Events of a common period.
struct LoopClock {
  std::int64_t action_period = 1;  ///< [ns]
  std::int64_t action_steps = 1;   ///< per common period, as all counts
  std::int64_t sensor_steps = 1;   ///< samples
  std::int64_t belief_steps = 1;   ///< belief updates
  std::int64_t predict_steps = 0;  ///< inner steps of the belief

  /// Events of a period as (time [ns], event), in order; those at its beginning belong to the period before.
  /// @param command_late of a command after an action step [ns], 0: at once; @param sample_early of a sample before the
  /// action step that uses it [ns].
  std::vector<std::pair<std::int64_t, LoopEvent>> events(std::int64_t command_late, std::int64_t sample_early) const;
};

}  // namespace jackal_aic
