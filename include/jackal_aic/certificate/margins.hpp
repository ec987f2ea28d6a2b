#pragma once

/// @file
/// What the certificates of both structures tell: whether a linear periodic loop is stable, how far it is from its
/// limit, and what that depends on.

#include <algorithm>
#include <optional>
#include <string>

namespace jackal_aic {

/// A spectral radius below this is stable. A neutral mode has the radius 1, which is not stable, whatever the rounding
/// of the map's own entries makes of it.
inline constexpr double kStabilityLimit = 1.0 - 1e-12;

/// Gain margins are searched up to this factor; a larger one is reported as this.
inline constexpr double kLargestGainMargin = 1000.0;

/// Delay margins are searched up to this, and up to kMostExtraActionPeriods; a larger one is reported as the bound [s].
inline constexpr double kLargestDelayMargin = 1.0;

/// Bounds the size of the map.
inline constexpr int kMostExtraActionPeriods = 250;

/// The largest delay margin that is searched for at an action period [s].
inline double largestDelayMargin(double action_period) {
  return std::min(kLargestDelayMargin, kMostExtraActionPeriods * action_period);
}

/// Change of a loop for which a margin asks.
struct LoopChange {
  double gain = 1.0;             ///< factor on kappa_a (thesis), on the wheel speed that a command gives (predictive)
  double extra_dead_time = 0.0;  ///< added to the robot's dead time, which stays 0 or more [s]
  double phase = 0.0;  ///< age of the newest measurement when the action is computed [s], up to longestPhase()
};

/// Spectral radii of a loop.
struct SpectralRadii {
  double belief_spectral_radius = 0.0;  ///< of the belief alone, which goes on while the robot is stopped
  double loop_spectral_radius = 0.0;  ///< of the closed loop over one common period, for the worst phase of the timers

  /// True if both are stable.
  bool stable() const { return belief_spectral_radius < kStabilityLimit && loop_spectral_radius < kStabilityLimit; }
};

/// Verdict on a loop.
struct LoopVerdict : SpectralRadii {
  double period = 0.0;              ///< common period of sensor, belief and action [s]
  double radius_uncertainty = 0.0;  ///< the true radius is not above loop_spectral_radius, and less than this below it
};

/// Margins below which a certificate warns, or which a search has to keep.
struct MarginBounds {
  double gain = 1.5;    ///< factor on the gain
  double delay = 0.03;  ///< [s]
};

/// How far a loop is from the limit of stability.
struct Margins {
  double gain_margin = 1.0;  ///< nearest factor on the gain at which the radius is 1: above 1 if stable, else below (0:
                             ///< none); kLargestGainMargin if there is none up to that
  double gain_reduction = 1.0;  ///< as gain_margin, for a lower gain: below 1 if stable; 0 if none down to 1e-3
  double delay_margin = 0.0;    ///< extra dead time at which the radius is 1 [s]; negative if unstable, at least
                                ///< -dead_time

  /// True if gain and delay margin are at least these.
  bool keeps(const MarginBounds& bounds) const { return gain_margin >= bounds.gain && delay_margin >= bounds.delay; }
};

/// Which of two bounds a stable loop does not keep.
enum class ThinMargin { none, gain, delay };

/// Relative sensitivity d ln(rho) / d ln(parameter) of the spectral radius rho, the belief's if that diverges, else the
/// loop's.
struct Sensitivity {
  std::string parameter;  ///< name of its key, without the section
  double value;           ///< d ln(rho) / d ln(parameter)
};

/// An interval of a gain in which loop and belief are stable, the other parameters fixed.
struct StableRange {
  double low;          ///< stable above
  double high;         ///< stable below
  bool low_is_bound;   ///< low is the end of the permitted range, not of stability
  bool high_is_bound;  ///< likewise
};

/// The parameter that is most to blame for an instability: one that was just changed, else the one to which the radius
/// is most sensitive among those of which another value alone helps.
struct Culprit {
  std::string parameter;                   ///< name of its key, without the section
  double value = 0.0;                      ///< what it is
  std::optional<StableRange> range = {};   ///< of it, the others as they are, if it was searched and found
  std::optional<double> stable_with = {};  ///< value before the change, or the default, if the loop is stable with it
};

}  // namespace jackal_aic
