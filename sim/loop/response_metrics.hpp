#pragma once

/// @file
/// Figures of a step response, as the thesis defines them (chapter 5, "Definitions and control setup").

#include <optional>
#include <vector>

namespace jackal_aic::sim {

/// Band around the final value, as a share of it, in which a response counts as settled (thesis, chapter 5).
inline constexpr double kSettlingBand = 0.05;

/// Time at the end of a response over which its final value is the mean [s].
inline constexpr double kFinalWindow = 0.5;

/// Figures of one step response.
struct ResponseMetrics {
  /// Time after the step from which the signal stays within the band around its final value [s]; empty if it never
  /// settles.
  std::optional<double> settling;
  /// Time from 10 % to 90 % of the set point [s]; empty if 90 % is never reached.
  std::optional<double> rise;
  /// Largest excursion beyond the set point, in percent of the step, at least 0.
  double overshoot_pct = 0.0;
  /// Mean of (signal - set point) over kFinalWindow, in percent of the step; positive if the signal is too fast.
  double steady_error_pct = 0.0;
  /// True if every sample is finite and the signal stays within `divergence` steps of the set point.
  bool bounded = true;
};

/// Computes the figures of a step from `initial` to `set_point` at `step_time`.
/// @param time stamps [s], increasing; @param value signal at these times; @param step_time time of the step [s];
/// @param initial set point before the step; @param set_point set point after it, different from initial;
/// @param settling_band share of the final value.
/// The final value is the mean over kFinalWindow. Crossings are interpolated linearly between samples.
/// @throws std::invalid_argument if the series differ in length, span less than kFinalWindow after the step, or the
/// step is zero.
ResponseMetrics stepResponseMetrics(const std::vector<double>& time, const std::vector<double>& value, double step_time,
                                    double initial, double set_point, double settling_band = kSettlingBand);

}  // namespace jackal_aic::sim
