#include "periodic_system.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// @param close says of the largest value on the grid whether to look between its neighbours.
template <class Value, class Close>
WorstPhase largestOverPhase(const Value& value, double longest, double enough, const Close& close) {
  constexpr int kGrid = 4, kHalvings = 4;
  WorstPhase worst{-kInfinity, 0.0};
  const auto look = [&](double phase) {
    if (worst.radius >= enough || phase < 0.0 || phase > longest) return;
    const double here = value(phase);
    if (here > worst.radius) worst = {here, phase};
  };
  for (int i = 0; i <= kGrid; ++i) look(longest * i / kGrid);
  double distance = longest / kGrid;
  for (int i = 0; i < kHalvings && close(worst.radius); ++i) {
    distance *= 0.5;
    const double centre = worst.phase;
    look(centre - distance);
    look(centre + distance);
  }
  return worst;
}

}  // namespace

WorstPhase worstOverPhase(const std::function<double(double phase)>& radius, double longest, double enough) {
  constexpr double kClose = 0.02;  // more than the radius changes between the points of the grid
  return largestOverPhase(radius, longest, enough, [](double worst) { return std::abs(worst - 1.0) < kClose; });
}

double smallestOverPhase(const std::function<double(double phase)>& margin, double longest) {
  const auto negative = [&](double phase) { return -margin(phase); };
  return -largestOverPhase(negative, longest, kInfinity, [](double worst) { return std::isfinite(worst); }).radius;
}

int commonActionSteps(double action_rate, double sensor_rate, const char* key) {
  const double sensor_steps_per_action = sensor_rate / action_rate;
  for (int n = 1; n <= kMostActionSteps; ++n) {
    const double steps = n * sensor_steps_per_action;
    if (steps > 0.5 && std::abs(steps - std::round(steps)) < 1e-6) return n;
  }
  throw ParameterError(fmt::format(
      "plant_model.sensor_rate = {:g} Hz: no common period with {} = {:g} Hz within {} action periods; round it",
      sensor_rate, key, action_rate, kMostActionSteps));
}

std::int64_t nanoseconds(double seconds) { return std::llround(1e9 * seconds); }

}  // namespace jackal_aic
