#include "periodic_system.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic {

double worstOverPhase(const std::function<double(double phase)>& radius, double longest, double enough) {
  constexpr int kGrid = 4, kHalvings = 4;
  constexpr double kClose = 0.02;  // more than the radius changes between the points of the grid
  double worst = -1.0, at = 0.0;
  const auto look = [&](double phase) {
    if (worst >= enough || phase < 0.0 || phase > longest) return;
    const double here = radius(phase);
    if (here <= worst) return;
    worst = here;
    at = phase;
  };
  for (int i = 0; i <= kGrid; ++i) look(longest * i / kGrid);
  double distance = longest / kGrid;
  for (int i = 0; i < kHalvings && std::abs(worst - 1.0) < kClose; ++i) {
    distance *= 0.5;
    const double centre = at;
    look(centre - distance);
    look(centre + distance);
  }
  return worst;
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
