#pragma once

/// @file
/// Stability of the predictive loop on a clock that is no clock.
///
/// Each action period has a phase of its own (age of the sample when the action is computed, from 0 to a period), an
/// extra dead time of its own in [0, d], and a sample that may be lost, up to k in a row. Each of these is a linear map
/// over a period (PredictiveLinearLoop::jitteredMap()), and a loop of which every map is stable may still be driven
/// apart by their order. It cannot if there are positive definite P_0 .. P_k, P_j for the state after j lost samples,
/// and a growth rate g < 1 such that for every map S of a period with a sample and L of one without
///
///     S' P_0 S <= g^2 P_j (j = 0..k),     L' P_(j+1) L <= g^2 P_j (j < k):
///
/// then x' P_j x falls by g^2 in every period of every sequence, which bounds its joint spectral radius (a
/// path-complete Lyapunov function, Ahmadi et al. 2014). They are found as the fixed point of
/// P_j <- least upper bound of the left sides / g^2, with a minimal upper bound of two matrices in the order of
/// quadratic forms (Allamigeon, Gaubert and Stott 2018), and checked whatever their origin.
///
/// The maps are affine in the belief's gain, of which the covariance depends on when samples came: every gain between
/// those of irregularGains() is covered. Phases and delays are a continuum. Within a cell of 1 ms of each, a
/// biquadratic surface through nine of its maps stays in the hull of its control points, on which the forms have to
/// fall; how far the map at a quarter of both ways is from that surface, the largest of all cells, is added to g. Left
/// out, as in the certificate of a regular clock: the acceleration limit, and the smaller gain while a wheel
/// accelerates; and more than one sample, or more than two commands, that act in one period.

#include "jackal_aic/certificate/predictive_certificate.hpp"

namespace jackal_aic {

/// How irregular a clock is, beside phases of any sequence.
struct Jitter {
  double extra_delay = 0.0;  ///< d, longest extra dead time of a period [s]
  int lost_samples = 0;      ///< k, most lost in a row
};

/// A growth per period of the state that no sequence within the jitter exceeds for long: below 1 the loop is stable,
/// else nothing is known; infinity if no forms are found. @throws ParameterError as jitteredMap().
double growthBound(const PredictiveLinearLoop& loop, const Jitter& jitter);

/// Extra delays are searched up to this [s].
inline constexpr double kLongestJitter = 0.04;

/// Samples lost in a row are searched up to this many.
inline constexpr int kMostLost = 5;

/// How irregular a clock may be.
struct JitterMargins {
  double delay = 0.0;      ///< largest certified d if no sample is lost [s]; kLongestJitter if it is not less
  int lost = 0;            ///< largest certified k without extra delay; kMostLost if it is not less
  bool any_phase = false;  ///< certified for every sequence of phases at all; else the others are 0
};

/// Margins of a loop, by bisection of growthBound(), d in steps of 5 ms: takes seconds. @throws ParameterError as
/// that.
JitterMargins jitterMargins(const PredictiveLinearLoop& loop);

}  // namespace jackal_aic
