#pragma once

/// @file
/// The square of an expression.

namespace jackal_aic {

/// x^2.
constexpr double square(double x) { return x * x; }

}  // namespace jackal_aic
