#include "form_search.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace jackal_aic {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kSharpest = 1e7, kSharper = 10.0;  // weight of t
constexpr int kSteps = 50;                          // of Newton, per weight
constexpr double kCentred = 1e-3;                   // Newton decrement
constexpr double kShortest = 1e-10;                 // part of a Newton step

double smallestEigenvalue(const MatrixXd& matrix) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(matrix, Eigen::EigenvaluesOnly).eigenvalues().minCoeff();
}

/// -log det; infinity of what is not positive definite.
double barrierOf(const MatrixXd& matrix) {
  const Eigen::LLT<MatrixXd> llt(matrix);
  if (llt.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
  return -2.0 * llt.matrixLLT().diagonal().array().log().sum();
}

}  // namespace

FormSearch::FormSearch(Index size, std::size_t forms)
    : size_(size),
      per_form_(size * (size + 1) / 2),
      forms_(forms),
      x_(VectorXd::Zero(per_form_ * static_cast<Index>(forms) + 1)) {
  for (std::size_t j = 0; j < forms; ++j) {
    for (Index a = 0; a < size; ++a) x_(index(j, a, a)) = 0.5;
  }
}

bool FormSearch::solve(const std::vector<FormEdge>& edges, double growth) {
  const std::vector<Constraint> constraints = constraintsOf(edges, growth);
  t() = 0.0;
  double lowest = 0.0;
  for (const Constraint& constraint : constraints) {
    if (constraint.edge) lowest = std::min(lowest, smallestEigenvalue(valueOf(constraint, x_)));
  }
  t() = lowest - 0.1;
  for (double weight = 1.0; weight <= kSharpest && t() <= 0.0; weight *= kSharper) {
    for (int i = 0; i < kSteps && t() <= 0.0; ++i) {
      if (!step(constraints, weight)) break;
    }
  }
  return t() > 0.0;
}

std::vector<FormSearch::Constraint> FormSearch::constraintsOf(const std::vector<FormEdge>& edges, double growth) const {
  std::vector<Constraint> constraints;
  for (const FormEdge& edge : edges) {
    constraints.push_back({{{edge.before, nullptr, growth * growth}, {edge.after, edge.map, -1.0}}, 0.0, true});
  }
  for (std::size_t j = 0; j < forms_; ++j) {
    constraints.push_back({{{j, nullptr, 1.0}}, 0.0, false});
    constraints.push_back({{{j, nullptr, -1.0}}, 1.0, false});
  }
  return constraints;
}

Index FormSearch::index(std::size_t form, Index a, Index b) const {
  const Index low = std::min(a, b), high = std::max(a, b);
  return static_cast<Index>(form) * per_form_ + high * (high + 1) / 2 + low;
}

MatrixXd FormSearch::formOf(const VectorXd& x, std::size_t form) const {
  MatrixXd P(size_, size_);
  for (Index a = 0; a < size_; ++a) {
    for (Index b = 0; b < size_; ++b) P(a, b) = x(index(form, a, b));
  }
  return P;
}

MatrixXd FormSearch::valueOf(const Constraint& constraint, const VectorXd& x) const {
  MatrixXd S = MatrixXd::Zero(size_, size_);
  S.diagonal().array() += constraint.offset - (constraint.edge ? x(x.size() - 1) : 0.0);
  for (const Part& part : constraint.parts) {
    const MatrixXd P = formOf(x, part.form);
    S += part.factor * (part.map != nullptr ? MatrixXd(part.map->transpose() * P * *part.map) : P);
  }
  return S;
}

double FormSearch::cost(const std::vector<Constraint>& constraints, const VectorXd& x, double weight) const {
  double sum = -weight * x(x.size() - 1);
  for (const Constraint& constraint : constraints) sum += barrierOf(valueOf(constraint, x));
  return sum;
}

/// Of -log det S with S = sum of x_v F_v: -tr(S^-1 F_v) and tr(S^-1 F_v S^-1 F_u).
void FormSearch::addSlope(const Constraint& constraint, Slope& slope) const {
  const MatrixXd inverse = valueOf(constraint, x_).llt().solve(MatrixXd::Identity(size_, size_));
  const Index count = per_form_ * static_cast<Index>(constraint.parts.size()) + (constraint.edge ? 1 : 0);
  MatrixXd products(size_ * size_, count), transposed(size_ * size_, count);  // S^-1 F_v, a column each
  std::vector<Index> variables;
  const auto take = [&](const MatrixXd& F, Index variable) {
    const auto column = static_cast<Index>(variables.size());
    const MatrixXd product = inverse * F, turned = product.transpose();
    products.col(column) = Eigen::Map<const VectorXd>(product.data(), product.size());
    transposed.col(column) = Eigen::Map<const VectorXd>(turned.data(), turned.size());
    slope.gradient(variable) -= product.trace();
    variables.push_back(variable);
  };
  for (const Part& part : constraint.parts) {
    const MatrixXd map = part.map != nullptr ? *part.map : MatrixXd(MatrixXd::Identity(size_, size_));
    for (Index a = 0; a < size_; ++a) {
      for (Index b = 0; b <= a; ++b) {
        MatrixXd F = part.factor * map.row(a).transpose() * map.row(b);
        if (a != b) F += F.transpose().eval();
        take(F, index(part.form, a, b));
      }
    }
  }
  if (constraint.edge) take(-MatrixXd::Identity(size_, size_), x_.size() - 1);
  const MatrixXd second = transposed.transpose() * products;
  for (Index i = 0; i < count; ++i) {
    for (Index k = 0; k < count; ++k) {
      slope.hessian(variables[static_cast<std::size_t>(i)], variables[static_cast<std::size_t>(k)]) += second(i, k);
    }
  }
}

/// A damped Newton step; false if it is centred, or as good as it gets.
bool FormSearch::step(const std::vector<Constraint>& constraints, double weight) {
  Slope slope{VectorXd::Zero(x_.size()), MatrixXd::Zero(x_.size(), x_.size())};
  slope.gradient(x_.size() - 1) = -weight;
  for (const Constraint& constraint : constraints) addSlope(constraint, slope);
  const VectorXd direction = -slope.hessian.ldlt().solve(slope.gradient);
  const double decrement = -slope.gradient.dot(direction), now = cost(constraints, x_, weight);
  if (!(decrement > kCentred)) return false;
  double length = 1.0;
  while (!(cost(constraints, x_ + length * direction, weight) < now - 0.1 * length * decrement)) {
    length *= 0.5;
    if (length < kShortest) return false;
  }
  x_ += length * direction;
  return true;
}

}  // namespace jackal_aic
