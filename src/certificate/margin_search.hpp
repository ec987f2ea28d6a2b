#pragma once

/// @file
/// The search for margins and causes that the certificates of both structures share. Internal to the core.

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "jackal_aic/certificate/margins.hpp"

namespace jackal_aic {

/// True if a loop is stable with a change.
using LoopTest = std::function<bool(const LoopChange&)>;

/// A loop of which the margins are searched.
struct SearchedLoop {
  bool is_stable;                                         ///< as it is
  LoopTest stable;                                        ///< at every phase
  std::function<Eigen::MatrixXd(const LoopChange&)> map;  ///< over a common period, at a phase
  bool foretellable;     ///< one sample and one action pass in a common period, for return_difference.hpp, and no wheel
                         ///< follows its command at once: else margins jump with the phase, and between those looked at
  double period;         ///< common period of the timers [s]
  double longest_phase;  ///< between them [s]
  double action_period;  ///< [s]
  double dead_time;      ///< of the robot [s]
};

/// Extra dead time [s] at which the verdict changes on the way from 0 to `end`; `end` if it does not.
double delayBoundary(const LoopTest& stable, double action_period, double end);

/// Margins of a loop. Those of a stable one are where its return difference has them, if the verdict changes there;
/// else a walk finds them, which asks at every stride.
Margins findMargins(const SearchedLoop& loop);

/// The first of two bounds that a loop does not keep.
ThinMargin thinMarginOf(const LoopTest& stable, const MarginBounds& bounds);

/// A parameter of a loop.
struct LoopParameter {
  std::string name;
  double value;                                            ///< present
  double largest;                                          ///< of its range
  std::function<SpectralRadii(double)> radii;              ///< of the loop with another value, the others as they are
  std::optional<double> fallback = {};                     ///< before a change, or its default; empty: no suspect
  bool changed = false;                                    ///< fallback is the value before a change
  std::function<std::optional<StableRange>()> range = {};  ///< where the loop is stable, if that is to be searched
};

/// Sensitivities by central differences of 1 %, the largest magnitude first; parameters without an effect are left out.
std::vector<Sensitivity> sensitivitiesTo(const std::vector<LoopParameter>& parameters);

/// Culprit of an instability. What was changed is asked first; else parameters that are 0, of which no factor tells the
/// effect, then those to which the radius is most sensitive. Empty if nothing has an effect.
std::optional<Culprit> findCulprit(const std::vector<LoopParameter>& parameters);

}  // namespace jackal_aic
