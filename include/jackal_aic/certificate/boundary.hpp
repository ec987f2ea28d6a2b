#pragma once

/// @file
/// Search of a boundary along a line: the limit of stability over the gain, the last usable value of a parameter.

#include <functional>
#include <optional>

namespace jackal_aic {

/// Test of a point on a line.
using LineTest = std::function<bool(double)>;

/// Change of a test's answer along a line: the last point before and the first after.
struct Boundary {
  double before;  ///< last point with the answer of the beginning
  double after;   ///< first point with the other answer
};

/// Walks from `start` along next(x) to `end`, the last tested point, and halves the first step that changes the answer,
/// until it is no longer than `precision` relative to its begin. Empty if the answer never changes.
std::optional<Boundary> findBoundary(const LineTest& holds, double start, double end,
                                     const std::function<double(double)>& next, double precision = 1e-6);

}  // namespace jackal_aic
