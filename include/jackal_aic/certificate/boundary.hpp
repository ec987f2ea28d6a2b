#pragma once

/// @file
/// Where something changes along a line: the limit of stability on the way to a larger gain, the last usable value of a
/// parameter.

#include <functional>
#include <optional>

namespace jackal_aic {

/// Says of a point on a line whether something holds there.
using LineTest = std::function<bool(double)>;

/// Where a test changes its answer along a line: the last point before and the first after.
struct Boundary {
  double before;  ///< last point with the answer of the beginning
  double after;   ///< first point with the other answer
};

/// Walks from `start` along next(x) to `end`, which is the last point it looks at, and halves the first step that
/// changes the answer until it is no longer than `precision`, relative to where it begins. Empty if the answer never
/// changes.
std::optional<Boundary> findBoundary(const LineTest& holds, double start, double end,
                                     const std::function<double(double)>& next, double precision = 1e-6);

}  // namespace jackal_aic
