#include "jackal_aic/certificate/boundary.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

constexpr int kMostHalvings = 40;

bool isNarrow(const Boundary& boundary, double precision) {
  return std::abs(boundary.after - boundary.before) <= precision * std::abs(boundary.before);
}

/// In the logarithm if both ends have one sign.
double middleOf(const Boundary& boundary) {
  const double product = boundary.before * boundary.after;
  return product > 0.0 ? std::copysign(std::sqrt(product), boundary.after) : 0.5 * (boundary.before + boundary.after);
}

}  // namespace

std::optional<Boundary> findBoundary(const LineTest& holds, double start, double end,
                                     const std::function<double(double)>& next, double precision) {
  const bool at_start = holds(start);
  for (double x = start; x != end;) {
    const double candidate = end > start ? std::min(next(x), end) : std::max(next(x), end);
    if (holds(candidate) == at_start) {
      x = candidate;
      continue;
    }
    Boundary boundary{x, candidate};
    for (int i = 0; i < kMostHalvings && !isNarrow(boundary, precision); ++i) {
      const double middle = middleOf(boundary);
      (holds(middle) == at_start ? boundary.before : boundary.after) = middle;
    }
    return boundary;
  }
  return std::nullopt;
}

}  // namespace jackal_aic
