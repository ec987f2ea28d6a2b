#pragma once

/// @file
/// The search for margins and causes that the certificates of both structures share. Internal to the core.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "jackal_aic/certificate/margins.hpp"

namespace jackal_aic {

/// True if a loop is stable with a change.
using LoopTest = std::function<bool(const LoopChange&)>;

/// Extra dead time [s] at which the verdict changes on the way from 0 to `end`; `end` if it does not.
double delayBoundary(const LoopTest& stable, double action_period, double end);

/// Margins of a loop. @param action_period [s]; @param dead_time of the robot [s].
Margins findMargins(const LoopTest& stable, double action_period, double dead_time);

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
