#pragma once

/// @file
/// Spectral radius of a map that may be far from normal, with a bound on its error.
///
/// A solver returns the eigenvalues of M + E with |E| <= n u |M|, n the size of the map and u the unit of rounding. An
/// eigenvalue with the right and left eigenvectors x and y then errs by no more than |x| |y| / |y' x| n u |M| (LAPACK
/// Users' Guide, 4.8). Scaling of the states by powers of two makes both factors small (Parlett and Reinsch 1969).

#include <Eigen/Core>

namespace jackal_aic {

/// Largest magnitude of an eigenvalue.
struct SpectralRadius {
  double value;        ///< as computed
  double uncertainty;  ///< largest error of the value

  /// Upper bound of the true value.
  double upper() const { return value + uncertainty; }
};

/// Spectral radius of a square map; eigenvalues within a tenth of the largest count. Both members are infinite if the
/// map or the radius is not finite.
SpectralRadius spectralRadiusOf(const Eigen::MatrixXd& map);

/// The radius alone, for a search; infinite if the map is not finite.
double spectralRadius(const Eigen::MatrixXd& map);

}  // namespace jackal_aic
