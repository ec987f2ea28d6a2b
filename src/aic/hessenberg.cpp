#include "hessenberg.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace jackal_aic {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Complex = std::complex<double>;

constexpr double kRounding = std::numeric_limits<double>::epsilon();
constexpr double kNoSquare = std::numeric_limits<double>::min() / kRounding;  // below, squares lose their digits
constexpr int kMostSteps = 40;    // of QR for an eigenvalue or a pair; two or three suffice
constexpr int kExceptional = 10;  // steps after which another shift is tried

/// Reflector I - tau v v', v = (1, v_1, ...), of N rows or columns from k on.
template <int N>
struct Reflector {
  double v[N], w[N];  // v and tau v
  double image;       // of the first entry of x, whose others become zero

  explicit Reflector(const double* x) : v{1.0}, w{}, image(x[0]) {
    double rest = 0.0;
    for (int i = 1; i < N; ++i) rest += x[i] * x[i];
    if (rest < kNoSquare) return;
    image = -std::copysign(std::sqrt(x[0] * x[0] + rest), x[0]);
    w[0] = (image - x[0]) / image;
    for (int i = 1; i < N; ++i) {
      v[i] = x[i] / (x[0] - image);
      w[i] = w[0] * v[i];
    }
  }

  /// Columns `first` to `last`. By a copy of which no entry of H can be a part: it stays in registers.
  void fromTheLeft(MatrixXd& H, Index k, Index first, Index last) const {
    const Reflector r = *this;
    for (Index j = first; j <= last; ++j) {
      double* x = &H(k, j);
      double product = x[0];
      for (int i = 1; i < N; ++i) product += r.v[i] * x[i];
      for (int i = 0; i < N; ++i) x[i] -= r.w[i] * product;
    }
  }

  /// Rows `first` to `last`, likewise: several at a time.
  void fromTheRight(MatrixXd& H, Index k, Index first, Index last) const {
    const Reflector r = *this;
    double* const x = &H(0, k);
    const Index column = H.outerStride();
    for (Index j = first; j <= last; ++j) {
      double product = x[j];
      for (int i = 1; i < N; ++i) product += r.v[i] * x[j + i * column];
      for (int i = 0; i < N; ++i) x[j + i * column] -= r.w[i] * product;
    }
  }

  /// Of the block from `low` to `high`, with column k - 1, which it clears, unless that is another block's.
  void apply(MatrixXd& H, Index k, Index low, Index high) const {
    if (k > low) {
      H(k, k - 1) = image;
      for (int i = 1; i < N; ++i) H(k + i, k - 1) = 0.0;
    }
    fromTheLeft(H, k, k, high);
    fromTheRight(H, k, low, std::min(k + 3, high));
  }
};

/// First state of the block that ends with state `high` and that no state above it drives.
Index beginOfBlock(const MatrixXd& H, Index high, double size) {
  Index low = high;
  for (; low > 0; --low) {
    const double beside = std::abs(H(low - 1, low - 1)) + std::abs(H(low, low));
    if (std::abs(H(low, low - 1)) <= kRounding * (beside > 0.0 ? beside : size)) break;
  }
  return low;
}

/// A QR step of the block from `low` to `high`, of three rows or more, with the shifts z^2 - trace z + determinant.
void qrStep(MatrixXd& H, Index low, Index high, double trace, double determinant) {
  const double below = H(low + 1, low);
  double x[3] = {H(low, low) * (H(low, low) - trace) + H(low, low + 1) * below + determinant,
                 below * (H(low, low) + H(low + 1, low + 1) - trace), below * H(low + 2, low + 1)};
  for (Index k = low; k <= high - 2; ++k) {
    if (k > low) std::copy_n(&H(k, k - 1), 3, x);
    Reflector<3>(x).apply(H, k, low, high);
  }
  Reflector<2>(&H(high - 1, high - 2)).apply(H, high - 1, low, high);
}

/// Of the pair on the diagonal from `low` on: both if they are real, else the one above the real axis.
void addPair(const MatrixXd& H, Index low, std::vector<Complex>& eigenvalues) {
  // z^2 - 2 p z + ...: z = a_2 + p +- sqrt(p^2 + b c), p = (a_1 - a_2) / 2
  const double p = 0.5 * (H(low, low) - H(low + 1, low + 1)), product = H(low, low + 1) * H(low + 1, low);
  const double square = p * p + product, root = std::sqrt(std::abs(square));
  if (square < 0.0) return eigenvalues.push_back({H(low + 1, low + 1) + p, root});
  const double far = p + std::copysign(root, p);
  eigenvalues.emplace_back(H(low + 1, low + 1) + far);
  eigenvalues.emplace_back(H(low + 1, low + 1) - (far != 0.0 ? product / far : 0.0));
}

/// x by (H - lambda) x = P' L 1 and y by (H - lambda)' y = U' 1, P (H - lambda) = L U.
template <class Scalar>
double conditionNumberOf(const MatrixXd& H, Scalar eigenvalue, double least) {
  using Rows = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  using Eigen::numext::abs2;
  const Index n = H.rows();
  Rows U = H.template cast<Scalar>();
  U.diagonal().array() -= eigenvalue;
  Vector factors = Vector::Zero(n);  // of the upper row that each step takes from the lower one
  std::vector<bool> swapped(static_cast<std::size_t>(n), false);
  for (Index k = 0; k < n; ++k) {
    const Index right = n - k;
    if (k + 1 < n && abs2(U(k + 1, k)) > abs2(U(k, k))) {
      U.row(k).tail(right).swap(U.row(k + 1).tail(right));
      swapped[static_cast<std::size_t>(k)] = true;
    }
    if (abs2(U(k, k)) < least * least) U(k, k) = least;
    if (k + 1 == n || U(k + 1, k) == 0.0) continue;
    factors(k) = U(k + 1, k) / U(k, k);
    U.row(k + 1).tail(right - 1) -= factors(k) * U.row(k).tail(right - 1);
  }
  const Vector x = U.template triangularView<Eigen::Upper>().solve(Vector::Ones(n));
  Vector y = U.adjoint().template triangularView<Eigen::Lower>().solve(Vector::Ones(n));
  for (Index k = n - 2; k >= 0; --k) {
    y(k) -= Eigen::numext::conj(factors(k)) * y(k + 1);
    if (swapped[static_cast<std::size_t>(k)]) std::swap(y(k), y(k + 1));
  }
  return x.norm() * y.norm() / std::abs(y.dot(x));
}

}  // namespace

MatrixXd hessenbergForm(MatrixXd map) {
  const Index n = map.rows();
  Eigen::VectorXd v(n), product(n);
  for (Index k = 0; k + 2 < n; ++k) {
    Index length = n - k - 1;
    while (length > 1 && map(k + length, k) == 0.0) --length;
    if (length == 1) continue;
    // I - tau v v', v = (1, ...), of rows and columns from k + 1 on
    const auto below = map.col(k).segment(k + 1, length);
    const double rest = below.tail(length - 1).squaredNorm();
    if (rest < kNoSquare) {
      map.col(k).segment(k + 2, length - 1).setZero();
      continue;
    }
    const double image = -std::copysign(std::sqrt(below(0) * below(0) + rest), below(0));
    const double tau = (image - below(0)) / image;
    v.head(length) = below / (below(0) - image);
    v(0) = 1.0;
    map.col(k).segment(k + 1, length).setZero();
    map(k + 1, k) = image;
    for (Index j = k + 1; j < n; ++j) {
      double* x = &map(k + 1, j);
      double product = 0.0;
      for (Index i = 0; i < length; ++i) product += v(i) * x[i];
      for (Index i = 0; i < length; ++i) x[i] -= tau * product * v(i);
    }
    product.setZero();
    for (Index i = 0; i < length; ++i) product += v(i) * map.col(k + 1 + i);
    for (Index i = 0; i < length; ++i) map.col(k + 1 + i) -= tau * v(i) * product;
  }
  return map;
}

std::vector<Complex> eigenvaluesOf(MatrixXd H) {
  const double size = H.norm();
  std::vector<Complex> eigenvalues;
  int steps = 0;
  for (Index high = H.rows() - 1; high >= 0;) {
    const Index low = beginOfBlock(H, high, size);
    if (high - low < 2) {
      low == high ? void(eigenvalues.emplace_back(H(high, high))) : addPair(H, low, eigenvalues);
      high = low - 1;
      steps = 0;
      continue;
    }
    if (++steps > kMostSteps) return {};
    double trace = H(high - 1, high - 1) + H(high, high);
    double determinant = H(high - 1, high - 1) * H(high, high) - H(high - 1, high) * H(high, high - 1);
    if (steps % kExceptional == 0) {
      trace = 1.5 * (std::abs(H(high, high - 1)) + std::abs(H(high - 1, high - 2)));
      determinant = trace * trace / 2.25;
    }
    qrStep(H, low, high, trace, determinant);
  }
  return eigenvalues;
}

double conditionNumber(const MatrixXd& hessenberg, Complex eigenvalue, double least) {
  return eigenvalue.imag() == 0.0 ? conditionNumberOf<double>(hessenberg, eigenvalue.real(), least)
                                  : conditionNumberOf<Complex>(hessenberg, eigenvalue, least);
}

}  // namespace jackal_aic
