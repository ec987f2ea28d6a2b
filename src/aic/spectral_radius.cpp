#include "jackal_aic/aic/spectral_radius.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

namespace jackal_aic {
namespace {

constexpr double kLeastReduction = 0.95;     // a scaling has to shorten row plus column to less than this fraction
constexpr double kSmallUncertainty = 1e-10;  // relative uncertainty that needs no extended precision
constexpr double kCountedFraction = 0.9;     // eigenvalues below this fraction of the radius do not count
constexpr double kCloseToLimit = 1e-6;  // relative distance from a limit within which the radius needs an error bound

template <class Real>
using Square = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

/// Removes the states that no other drives or that drive no other. Their eigenvalues are entries of the diagonal, and
/// exact. Returns the largest magnitude of these.
double isolated(Eigen::MatrixXd& map) {
  std::vector<Eigen::Index> kept(static_cast<std::size_t>(map.rows()));
  std::iota(kept.begin(), kept.end(), 0);
  double largest = 0.0;
  const auto alone = [&](Eigen::Index i) {
    const auto any = [&](const auto& coupled) {
      return std::any_of(kept.begin(), kept.end(), [&](Eigen::Index j) { return j != i && coupled(j) != 0.0; });
    };
    if (any([&](Eigen::Index j) { return map(i, j); }) && any([&](Eigen::Index j) { return map(j, i); })) return false;
    largest = std::max(largest, std::abs(map(i, i)));
    return true;
  };
  // Removing one may isolate others.
  for (auto found = kept.begin(); (found = std::find_if(kept.begin(), kept.end(), alone)) != kept.end();) {
    kept.erase(found);
  }
  const auto size = static_cast<Eigen::Index>(kept.size());
  map = Eigen::MatrixXd::NullaryExpr(size, size, [&](Eigen::Index i, Eigen::Index j) {
          return map(kept[static_cast<std::size_t>(i)], kept[static_cast<std::size_t>(j)]);
        }).eval();
  return largest;
}

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
template <class Real>
Real conditionNumber(const Square<std::complex<Real>>& T, Eigen::Index i, Real least) {
  Square<std::complex<Real>> shifted = T;
  for (Eigen::Index j = 0; j < T.rows(); ++j) {
    shifted(j, j) -= T(i, i);
    if (std::abs(shifted(j, j)) < least) shifted(j, j) = least;
  }
  // x = (−(T11 − λ)⁻¹ t, 1, 0) and y = (0, 1, −(T22 − λ)⁻' t'), so that y' x = 1
  const Eigen::Index above = i, below = T.rows() - 1 - i;
  using Vector = Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, 1>;
  const Vector x =
      shifted.topLeftCorner(above, above).template triangularView<Eigen::Upper>().solve(T.col(i).head(above));
  const Square<std::complex<Real>> lower = shifted.bottomRightCorner(below, below).adjoint();
  const Vector y = lower.template triangularView<Eigen::Lower>().solve(T.row(i).tail(below).adjoint());
  return std::sqrt((Real(1) + x.squaredNorm()) * (Real(1) + y.squaredNorm()));
}

/// Of a balanced map whose largest entry is about 1.
template <class Real>
SpectralRadius radiusWithBound(const Square<Real>& map) {
  using Complex = std::complex<Real>;
  const Eigen::Index n = map.rows();
  const Eigen::RealSchur<Square<Real>> real(map, false);
  if (real.info() != Eigen::Success) return {HUGE_VAL, HUGE_VAL};
  Eigen::ComplexSchur<Square<Complex>> schur(n);
  schur.computeFromHessenberg(real.matrixT().template cast<Complex>(), Square<Complex>::Identity(n, n), false);
  if (schur.info() != Eigen::Success) return {HUGE_VAL, HUGE_VAL};
  const Square<Complex> T = schur.matrixT();

  const Real rounding = std::numeric_limits<Real>::epsilon() * map.norm();
  const Real error = static_cast<Real>(2 * n) * rounding;  // |E|, with a factor of two to spare
  // No eigenvalue moves farther than (|M| + |M + E|)^(1 - 1/n) |E|^(1/n) (Elsner 1985), however ill-conditioned.
  const Real farthest = std::pow(2 * map.norm(), Real(1) - Real(1) / n) * std::pow(error, Real(1) / n);
  const Real radius = T.diagonal().cwiseAbs().maxCoeff();
  Real upper = radius;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Real magnitude = std::abs(T(i, i));
    if (magnitude < kCountedFraction * radius) continue;
    upper = std::max(upper, magnitude + std::min(farthest, error * conditionNumber<Real>(T, i, rounding)));
  }
  return {static_cast<double>(radius), static_cast<double>(upper - radius)};
}

}  // namespace

SpectralRadius spectralRadiusOf(const Eigen::MatrixXd& map) {
  if (!map.allFinite()) return {HUGE_VAL, HUGE_VAL};
  Eigen::MatrixXd scaled = map;
  const double alone = isolated(scaled);
  if (scaled.size() == 0) return {alone, 0.0};
  scaled = balanced(std::move(scaled));
  const double size = std::exp2(std::ceil(std::log2(scaled.cwiseAbs().maxCoeff())));
  scaled /= size;
  // Values far below rounding are removed, because their squares are subnormal.
  const double negligible = std::pow(std::numeric_limits<double>::epsilon(), 3);
  scaled = (scaled.array().abs() < negligible).select(0.0, scaled).eval();
  SpectralRadius radius = radiusWithBound<double>(scaled);
  if (radius.uncertainty > kSmallUncertainty * radius.value) {
    radius = radiusWithBound<long double>(scaled.cast<long double>());
  }
  const double value = std::max(alone, size * radius.value);
  const double rounding = std::numeric_limits<double>::epsilon() * size * radius.value;
  return {value, std::max(alone, size * radius.upper() + rounding) - value};
}

double spectralRadiusBeside(double limit, const Eigen::MatrixXd& map) {
  if (!map.allFinite()) return HUGE_VAL;
  Eigen::MatrixXd driven = map;
  double radius = isolated(driven);
  if (driven.size() > 0) {
    const Eigen::EigenSolver<Eigen::MatrixXd> solver(balanced(std::move(driven)), false);
    if (solver.info() != Eigen::Success) return spectralRadiusOf(map).upper();
    radius = std::max(radius, solver.eigenvalues().cwiseAbs().maxCoeff());
  }
  // This comparison is false for NaN, too.
  return std::abs(radius - limit) > kCloseToLimit * std::max(radius, limit) ? radius : spectralRadiusOf(map).upper();
}

}  // namespace jackal_aic
