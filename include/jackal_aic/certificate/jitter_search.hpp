#pragma once

/// @file
/// A search for sequences that destabilise the predictive loop on an irregular clock. Each action period has its own
/// phase (0 to a period) and its own extra dead time (0 to d), and up to k samples in a row are lost. Each period is a
/// linear map (LinearLoop::jitteredMap()). An adversary draws sequences of 1 to 10 periods and repeats each forever: it
/// grows if the spectral radius of the product is above 1. A sequence that the adversary does not find may still grow.

#include "jackal_aic/certificate/linear_loop.hpp"

namespace jackal_aic {

/// Irregularity of a clock, in addition to phases in any sequence.
struct Jitter {
  double extra_delay = 0.0;  ///< d, longest extra dead time of a period [s]
  int lost_samples = 0;      ///< k, most lost in a row
};

/// Sequences that a search draws.
inline constexpr int kJitterSequences = 10000;

/// The largest growth per period of the state in all sequences that are drawn: above 1 the loop is unstable.
/// @throws ParameterError as jitteredMap().
double worstGrowth(const LinearLoop& loop, const Jitter& jitter, int sequences = kJitterSequences);

/// Extra delays are searched up to this [s].
inline constexpr double kLongestJitter = 0.04;

/// Samples lost in a row are searched up to this many.
inline constexpr int kMostLost = 5;

/// How irregular a clock may be before a search finds a sequence that grows.
struct JitterMargins {
  double delay = 0.0;      ///< d if no sample is lost, in steps of 5 ms [s]; kLongestJitter if none grows
  int lost = 0;            ///< k without extra delay; kMostLost if none grows
  bool any_phase = false;  ///< true if phases alone make no sequence grow; if false, delay and lost are 0
};

/// Margins of a loop: takes seconds. @throws ParameterError as jitteredMap().
JitterMargins jitterMargins(const LinearLoop& loop);

}  // namespace jackal_aic
