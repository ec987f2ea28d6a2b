#pragma once

/// @file
/// What a drive from rest to a set point and back to rest is judged by: in the table of all presets (stop_table.hpp)
/// and by `tune`.

#include <optional>
#include <string>
#include <vector>

#include "closed_loop.hpp"

namespace jackal_aic::sim {

/// Figures of such a drive, each of the worse of its channels: forward speed and yaw rate, where the set point has
/// them.
struct StopFigures {
  std::optional<double> settling = 0.0;  ///< time until both stay within 5 % of the set point of what they end at [s];
                                         ///< empty: never
  double overshoot_pct = 0.0;  ///< largest excursion until the stop beyond the set point or, if it is more, what the
                               ///< channel ends at; of the set point. A robot that turns faster on an arc than its
                               ///< model says is off, but does not overshoot
  double beyond_mps = 0.0;     ///< largest forward speed beyond zero after the stop [m/s]
  double beyond_radps = 0.0;   ///< largest yaw rate beyond zero after the stop [rad/s]
  double ripple = 0.0;         ///< rms of a wheel's command about its mean before the stop and at rest [rad/s]
  double excess_pct = 0.0;     ///< largest excursion until the stop beyond the set point, of the set point

  /// Takes over what is worse.
  void worsen(const StopFigures& other);
};

/// What the figures of such a drive have to keep: of a robot that is its controller's model.
struct StopBars {
  double overshoot_pct = 10.0;
  double beyond_mps = 0.03;
  double beyond_radps = 0.05;
  double ripple = 0.1;

  /// Those of a robot that is not its model: a motor that is slower than believed brings it back later.
  static StopBars offModel(double overshoot_pct) { return {overshoot_pct, 0.10, 0.15}; }

  /// True if a robot that is told to stop runs and turns back no further.
  bool keepStop(const StopFigures& figures) const;

  /// The first figure that is not kept, in words; empty if every one is.
  std::string missed(const StopFigures& figures) const;
};

/// From rest to a set point at kRestTime, back to rest after `drive` [s], and `stand` [s] more.
SetPointProfile stopProfile(const SetPoint& set_point, double drive, double stand);

/// Figures of a run along stopProfile().
StopFigures assessStop(const std::vector<Sample>& samples, const SetPoint& set_point, double drive);

}  // namespace jackal_aic::sim
