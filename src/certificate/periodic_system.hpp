#pragma once

/// @file
/// What the linear periodic systems of the closed loop have in common: the common period of sensor and action, and the
/// phase between them. Internal to the core.

#include <cstdint>
#include <functional>

namespace jackal_aic {

/// Longest common period [action periods].
inline constexpr int kMostActionSteps = 50;

/// Where a radius is largest over the phase between two timers.
struct WorstPhase {
  double radius;
  double phase;  ///< [s]
};

/// Largest of a radius over the phase between two timers, from 0 to `longest` [s]: on a grid, and where that is close
/// to the limit of stability also between the neighbours of its largest value, so that the verdict does not depend on
/// the grid. @param enough a radius that is worse than any need be: the search ends there.
WorstPhase worstOverPhase(const std::function<double(double phase)>& radius, double longest, double enough);

/// Smallest of a margin over the phase, from 0 to `longest` [s]: on the same grid, and between the neighbours of its
/// smallest value.
double smallestOverPhase(const std::function<double(double phase)>& margin, double longest);

/// Smallest number of action periods that is a whole number of sensor periods. @param key of the action rate, for the
/// message. @throws ParameterError if there is none within kMostActionSteps.
int commonActionSteps(double action_rate, double sensor_rate, const char* key);

/// [ns]
std::int64_t nanoseconds(double seconds);

}  // namespace jackal_aic
