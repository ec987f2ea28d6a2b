#pragma once

/// @file
/// Search for the usable range of a parameter (Table 5-7).

#include <functional>

#include "experiment_table.hpp"

namespace jackal_aic::sim {

/// Result of a search.
struct RangeLimit {
  double value;   ///< last usable value
  bool at_bound;  ///< true if everything up to the bound of the search is usable
};

/// Walks from a usable start to a bound (both positive) in steps of a quarter octave until a value is unusable, then
/// bisects to 0.5 %. So it finds the first limit on the way, whatever lies beyond it.
RangeLimit searchLimit(double start, double bound, const std::function<bool(double)>& usable);

/// The searches behind a row of Table 5-7 for one integrator:
/// - closed loop: the step to 0.5 m/s on the plant settles within 4 s; for kappa_a, as in the thesis, also no later
/// than with
///   the standard kappa_a. The row has the limit in the column of its parameter and the figures of the response at the
///   limit;
/// - belief update alone: its spectral radius is below 1. The row has no plant. kappa_a does not enter, so it has no
/// such row. A parameter that is usable up to the bound of the search (tau 1e-5 s, kappa_mu 1000, kappa_a 1000) has
/// that bound.
std::vector<Run> usableRangeRuns(const PackageFiles& files, const ThesisLimit& limit, Integrator integrator);

}  // namespace jackal_aic::sim
