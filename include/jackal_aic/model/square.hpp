#pragma once

/// @file
/// The square of what would have to be written twice.

namespace jackal_aic {

/// x^2.
constexpr double square(double x) { return x * x; }

}  // namespace jackal_aic
