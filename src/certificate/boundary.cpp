#include "jackal_aic/certificate/boundary.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

bool isNarrow(const Boundary& boundary, double precision) {
  return precision > 0.0 && std::abs(boundary.after / boundary.before - 1.0) <= precision;
}

Boundary narrowed(const LineTest& holds, bool before, Boundary boundary, const Bisection& bisection) {
  for (int i = 0; i < bisection.most && !isNarrow(boundary, bisection.precision); ++i) {
    const double middle =
        bisection.geometric ? std::sqrt(boundary.before * boundary.after) : 0.5 * (boundary.before + boundary.after);
    (holds(middle) == before ? boundary.before : boundary.after) = middle;
  }
  return boundary;
}

}  // namespace

std::optional<Boundary> findBoundary(const LineTest& holds, double start, double end,
                                     const std::function<double(double)>& next, const Bisection& bisection) {
  const bool at_start = holds(start);
  for (double x = start; x != end;) {
    const double candidate = end > start ? std::min(next(x), end) : std::max(next(x), end);
    if (holds(candidate) != at_start) return narrowed(holds, at_start, {x, candidate}, bisection);
    x = candidate;
  }
  return std::nullopt;
}

}  // namespace jackal_aic
