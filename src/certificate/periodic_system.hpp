#pragma once

/// @file
/// What the linear periodic systems of the closed loop have in common: the common period of sensor and action, and the
/// search for where a verdict changes. Internal to the core.

#include <cstdint>
#include <functional>
#include <optional>

namespace jackal_aic {

/// Longest common period [action periods].
inline constexpr int kMostActionSteps = 50;

/// Largest of a radius over the phase between two timers, from 0 to `longest` [s]: on a grid, and where that is close
/// to the limit of stability also between the neighbours of its largest value, so that the verdict does not depend on
/// the grid.
double worstOverPhase(const std::function<double(double phase)>& radius, double longest);

/// Smallest number of action periods that is a whole number of sensor periods. @param key of the action rate, for the
/// message. @throws ParameterError if there is none within kMostActionSteps.
int commonActionSteps(double action_rate, double sensor_rate, const char* key);

/// [ns]
std::int64_t nanoseconds(double seconds);

/// Says of a point on a line whether something holds there.
using LineTest = std::function<bool(double)>;

/// Where a test changes its answer along a line: the last point before and the first after.
struct Boundary {
  double before;
  double after;
};

/// Walks from `start` along next(x) to `end`; halves the step that changes the answer down to 1/16000 of it. Empty if
/// the answer never changes.
std::optional<Boundary> findBoundary(const LineTest& holds, double start, double end,
                                     const std::function<double(double)>& next);

}  // namespace jackal_aic
