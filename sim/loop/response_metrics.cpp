#include "response_metrics.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace jackal_aic::sim {
namespace {

constexpr double kDivergence = 3.0;  // steps away from the set point

/// A response normalised to a step from 0 to 1 at time 0.
struct UnitResponse {
  std::vector<double> time;
  std::vector<double> value;
};

UnitResponse normalise(const std::vector<double>& time, const std::vector<double>& value, double step_time,
                       double initial, double set_point) {
  UnitResponse unit;
  for (std::size_t i = 0; i < time.size(); ++i) {
    if (time[i] < step_time) continue;
    unit.time.push_back(time[i] - step_time);
    unit.value.push_back((value[i] - initial) / (set_point - initial));
  }
  return unit;
}

/// First time at which the response reaches a level from below, interpolated.
std::optional<double> firstCrossing(const UnitResponse& unit, double level) {
  for (std::size_t i = 0; i < unit.value.size(); ++i) {
    if (unit.value[i] < level) continue;
    if (i == 0) return unit.time[0];
    const double fraction = (level - unit.value[i - 1]) / (unit.value[i] - unit.value[i - 1]);
    return unit.time[i - 1] + fraction * (unit.time[i] - unit.time[i - 1]);
  }
  return std::nullopt;
}

double meanSince(const UnitResponse& unit, double start) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < unit.time.size(); ++i) {
    if (unit.time[i] < start) continue;
    sum += unit.value[i];
    ++count;
  }
  return sum / static_cast<double>(count);
}

/// Time of the last entry into the band around the final value; empty if the response is outside it in the final
/// window.
std::optional<double> settlingTime(const UnitResponse& unit, double final_value, double window_start, double share) {
  const double band = share * std::abs(final_value);
  for (std::size_t i = unit.value.size(); i-- > 0;) {
    const double deviation = std::abs(unit.value[i] - final_value);
    if (deviation <= band) continue;
    if (unit.time[i] >= window_start || i + 1 == unit.value.size()) return std::nullopt;
    const double next = std::abs(unit.value[i + 1] - final_value);
    const bool same_side = (unit.value[i] > final_value) == (unit.value[i + 1] > final_value);
    const double fraction =
        same_side ? (deviation - band) / (deviation - next) : (deviation - band) / (deviation + next);
    return unit.time[i] + fraction * (unit.time[i + 1] - unit.time[i]);
  }
  return 0.0;
}

}  // namespace

ResponseMetrics stepResponseMetrics(const std::vector<double>& time, const std::vector<double>& value, double step_time,
                                    double initial, double set_point, double settling_band) {
  if (time.size() != value.size()) throw std::invalid_argument("step response: time and value differ in length");
  if (set_point == initial) throw std::invalid_argument("step response: the step is zero");
  const UnitResponse unit = normalise(time, value, step_time, initial, set_point);
  if (unit.time.empty() || unit.time.back() < kFinalWindow) {
    throw std::invalid_argument("step response: less than 0.5 s recorded after the step");
  }

  ResponseMetrics metrics;
  metrics.bounded = std::all_of(unit.value.begin(), unit.value.end(),
                                [](double v) { return std::isfinite(v) && std::abs(v - 1.0) <= kDivergence; });
  if (!metrics.bounded) return metrics;

  const double window_start = unit.time.back() - kFinalWindow;
  const double final_value = meanSince(unit, window_start);
  // The band is relative to the final value, so it needs one beyond the band.
  if (std::abs(final_value) > settling_band) {
    metrics.settling = settlingTime(unit, final_value, window_start, settling_band);
  }
  const auto low = firstCrossing(unit, 0.1);
  const auto high = firstCrossing(unit, 0.9);
  if (low && high) metrics.rise = *high - *low;
  metrics.overshoot_pct = 100.0 * std::max(0.0, *std::max_element(unit.value.begin(), unit.value.end()) - 1.0);
  metrics.steady_error_pct = 100.0 * (final_value - 1.0);
  return metrics;
}

}  // namespace jackal_aic::sim
