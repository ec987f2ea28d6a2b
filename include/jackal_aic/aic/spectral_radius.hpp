#pragma once

/// @file
/// Spectral radius of a map that may be far from normal, as an upper bound: the norm of a high power,
///
///     rho(M) <= |M^n|^(1/n),    n = 2^50
///
/// (Gelfand). It exceeds the radius by a part of ln(c)/n, with the condition number c of the eigenvectors, and does not
/// depend on the units of the states.

#include <Eigen/Core>

namespace jackal_aic {

/// Spectral radius of a square map; infinite if the map is not finite.
double spectralRadius(Eigen::MatrixXd map);

}  // namespace jackal_aic
