#pragma once

/// @file
/// Spectral radius of a map that may be far from normal, with a bound on its error.
///
/// An eigenvalue solver is backward stable: what it returns are the eigenvalues of M + E with |E| <= n u |M|, n the
/// size of the map and u the unit of rounding. An eigenvalue with the right and left eigenvectors x and y then errs by
/// no more than |x| |y| / |y' x| n u |M| (LAPACK Users' Guide, 4.8; to first order). A map over states of very
/// different size makes both factors large, so the states are scaled first until the rows of M are as long as its
/// columns (Parlett and Reinsch 1969), by powers of two, which round nothing. Where the bound is still large after
/// that, the eigenvalues are computed again in extended precision.

#include <Eigen/Core>

namespace jackal_aic {

/// Largest magnitude of an eigenvalue.
struct SpectralRadius {
  double value;        ///< as computed
  double uncertainty;  ///< how far the true one may be away from it

  /// The true one is not larger.
  double upper() const { return value + uncertainty; }
};

/// Spectral radius of a square map. Eigenvalues count that come within a tenth of the largest. Both members are
/// infinite if the map or the radius is not finite.
SpectralRadius spectralRadiusOf(const Eigen::MatrixXd& map);

/// On the same side of a limit as spectralRadiusOf(map).upper(), and sooner told: the eigenvalues of the scaled map
/// without a bound on their error, unless they come within 1e-6 of the limit.
double spectralRadiusBeside(double limit, const Eigen::MatrixXd& map);

}  // namespace jackal_aic
