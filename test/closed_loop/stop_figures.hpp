#pragma once

/// @file
/// What a drive from rest to a set point and back to rest is judged by, as sim/lab/stops.py does.

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "step_response.hpp"

namespace jackal_aic::sim {

/// Figures of such a drive, each of the worse of its channels: forward speed and yaw rate, where the set point has
/// them.
struct StopFigures {
  std::optional<double> settling = 0.0;  ///< time until both stay within 5 % of the set point of what they end at [s];
                                         ///< empty: never
  double overshoot_pct = 0.0;  ///< largest excursion until the stop beyond the set point or, if it is more, what the
                               ///< channel ends at; of the set point
  double beyond_mps = 0.0;     ///< largest forward speed beyond zero after the stop [m/s]
  double beyond_radps = 0.0;   ///< largest yaw rate beyond zero after the stop [rad/s]
  double excess_pct = 0.0;     ///< largest excursion until the stop beyond the set point, of the set point
};

inline constexpr double kSteadyTime = 1.0;      // s before the stop
inline constexpr double kSettledWithin = 0.05;  // of the set point

/// From rest to a set point at kRestTime, back to rest after `drive` [s], and `stand` [s] more.
inline AssessedProfile stopProfile(const SetPoint& set_point, double drive, double stand) {
  AssessedProfile profile;
  profile.changes = {{kRestTime, set_point}, {kRestTime + drive, SetPoint{}}};
  profile.duration = kRestTime + drive + stand;
  profile.assessed.reset();
  return profile;
}

/// Mean of a channel before the stop.
inline double finalValue(const std::vector<Sample>& samples, double stop, double Sample::*channel) {
  double sum = 0.0, count = 0.0;
  for (const Sample& s : samples) {
    if (s.time < stop - kSteadyTime || s.time >= stop) continue;
    sum += s.*channel;
    ++count;
  }
  return sum / count;
}

/// Adds the figures of one channel. @param beyond figure of what is beyond zero.
inline void assessChannel(const std::vector<Sample>& samples, double stop, double set_point, double Sample::*channel,
                          StopFigures& figures, double& beyond) {
  if (set_point == 0.0) return;
  const double end = finalValue(samples, stop, channel);
  const double level = std::max(1.0, end / set_point);
  double settled = kRestTime;
  for (const Sample& s : samples) {
    const double along = s.*channel / set_point;
    if (s.time > stop) {
      beyond = std::max(beyond, -along * std::abs(set_point));
      continue;
    }
    figures.overshoot_pct = std::max(figures.overshoot_pct, 100.0 * (along - level));
    figures.excess_pct = std::max(figures.excess_pct, 100.0 * (along - 1.0));
    if (std::abs(s.*channel - end) > kSettledWithin * std::abs(set_point)) settled = s.time;
  }
  const bool settles = settled < stop - kSteadyTime && figures.settling;
  figures.settling = settles ? std::optional(std::max(*figures.settling, settled - kRestTime)) : std::nullopt;
}

/// Figures of a run along stopProfile().
inline StopFigures assessStop(const std::vector<Sample>& samples, const SetPoint& set_point, double drive) {
  const double stop = kRestTime + drive - 0.5 * JackalPlant::kStep;
  StopFigures figures;
  assessChannel(samples, stop, set_point.forward, &Sample::velocity, figures, figures.beyond_mps);
  assessChannel(samples, stop, set_point.yaw_rate, &Sample::yaw_rate, figures, figures.beyond_radps);
  return figures;
}

}  // namespace jackal_aic::sim
