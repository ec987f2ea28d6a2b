#include "jackal_aic/aic/spectral_radius.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <utility>

namespace jackal_aic {
namespace {

constexpr double kLeastReduction = 0.95;  // a scaling has to shorten row plus column to less than this fraction
constexpr double kCountedFraction = 0.9;  // eigenvalues below this fraction of the radius do not count

using Complex = std::complex<double>;

/// The map with its states scaled by powers of two, so that each row is as long as its column.
Eigen::MatrixXd balanced(Eigen::MatrixXd map) {
  bool changed = true;
  while (changed) {
    changed = false;
    for (Eigen::Index i = 0; i < map.rows(); ++i) {
      const double diagonal = std::exchange(map(i, i), 0.0);
      const double column = map.col(i).lpNorm<1>(), row = map.row(i).lpNorm<1>();
      const double factor = column > 0.0 && row > 0.0 ? std::exp2(std::round(0.5 * std::log2(row / column))) : 1.0;
      if (factor * column + row / factor < kLeastReduction * (column + row)) {
        map.col(i) *= factor;
        map.row(i) /= factor;
        changed = true;
      }
      map(i, i) = diagonal;
    }
  }
  return map;
}

/// |x| |y| / |y' x| of the eigenvalue in place i of the diagonal of an upper triangular T. @param least difference of
/// two eigenvalues that counts.
double conditionNumber(const Eigen::MatrixXcd& T, Eigen::Index i, double least) {
  Eigen::MatrixXcd shifted = T;
  for (Eigen::Index j = 0; j < T.rows(); ++j) {
    shifted(j, j) -= T(i, i);
    if (std::abs(shifted(j, j)) < least) shifted(j, j) = least;
  }
  // x = (−(T11 − λ)⁻¹ t, 1, 0) and y = (0, 1, −(T22 − λ)⁻' t'), so that y' x = 1
  const Eigen::Index above = i, below = T.rows() - 1 - i;
  const Eigen::VectorXcd x =
      shifted.topLeftCorner(above, above).triangularView<Eigen::Upper>().solve(T.col(i).head(above));
  const Eigen::MatrixXcd lower = shifted.bottomRightCorner(below, below).adjoint();
  const Eigen::VectorXcd y = lower.triangularView<Eigen::Lower>().solve(T.row(i).tail(below).adjoint());
  return std::sqrt((1.0 + x.squaredNorm()) * (1.0 + y.squaredNorm()));
}

}  // namespace

double spectralRadius(const Eigen::MatrixXd& map) {
  if (!map.allFinite()) return HUGE_VAL;
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(balanced(map), false);
  return solver.info() == Eigen::Success ? solver.eigenvalues().cwiseAbs().maxCoeff() : HUGE_VAL;
}

SpectralRadius spectralRadiusOf(const Eigen::MatrixXd& map) {
  if (!map.allFinite()) return {HUGE_VAL, HUGE_VAL};
  const double size = map.cwiseAbs().maxCoeff();
  if (size == 0.0) return {0.0, 0.0};
  const Eigen::MatrixXd scaled = balanced(map / size);
  const Eigen::ComplexSchur<Eigen::MatrixXcd> schur(scaled.cast<Complex>(), false);
  if (schur.info() != Eigen::Success) return {HUGE_VAL, HUGE_VAL};
  const Eigen::MatrixXcd& T = schur.matrixT();
  const double rounding = std::numeric_limits<double>::epsilon() * scaled.norm();
  const double error = 2.0 * static_cast<double>(map.rows()) * rounding;  // |E|, with a factor of two to spare
  const double radius = T.diagonal().cwiseAbs().maxCoeff();
  double upper = radius;
  for (Eigen::Index i = 0; i < T.rows(); ++i) {
    const double magnitude = std::abs(T(i, i));
    if (magnitude < kCountedFraction * radius) continue;
    upper = std::max(upper, magnitude + error * conditionNumber(T, i, rounding));
  }
  return {size * radius, size * (upper - radius)};
}

}  // namespace jackal_aic
