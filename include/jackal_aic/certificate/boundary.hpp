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

/// How the step that changes the answer is narrowed down.
struct Bisection {
  int most = 14;           ///< halvings: 1/16000 of the step
  double precision = 0.0;  ///< ends where the two points differ by no more than this, relative to the first
  bool geometric = false;  ///< halves in the logarithm (of points of one sign) instead of in the middle
};

/// Walks from `start` along next(x) to `end`, which is the last point it looks at, and narrows down the first step that
/// changes the answer, whatever lies beyond it. Empty if the answer never changes.
std::optional<Boundary> findBoundary(const LineTest& holds, double start, double end,
                                     const std::function<double(double)>& next, const Bisection& bisection = {});

}  // namespace jackal_aic
