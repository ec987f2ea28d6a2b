#pragma once

/// @file
/// Quadratic forms that fall along linear maps: a small semidefinite program. Internal to the core.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace jackal_aic {

/// A map between two states, each with a form of its own.
struct FormEdge {
  const Eigen::MatrixXd* map;
  std::size_t before, after;  ///< which forms
};

/// Finds symmetric forms 0 < P_j < I that fall by more than g^2 on every edge, by maximising t in
///
///     g^2 P_before - M' P_after M > t I
///
/// along the path of the analytic centres of its logarithmic barrier, by Newton steps (Boyd and Vandenberghe 2004,
/// section 11.3), until t is positive.
class FormSearch {
 public:
  /// @param size of the states; @param forms how many.
  FormSearch(Eigen::Index size, std::size_t forms);

  /// True if it finds them. Goes on from the last forms. @param growth g.
  bool solve(const std::vector<FormEdge>& edges, double growth);

  /// P_j.
  Eigen::MatrixXd form(std::size_t j) const { return formOf(x_, j); }

 private:
  /// What a form adds to a matrix that has to be positive definite: factor M' P M, without a map factor P.
  struct Part {
    std::size_t form;
    const Eigen::MatrixXd* map;
    double factor;
  };
  /// A matrix that has to be positive definite: offset I, and parts, and -t I for an edge.
  struct Constraint {
    std::vector<Part> parts;
    double offset;
    bool edge;
  };
  /// Of the barrier.
  struct Slope {
    Eigen::VectorXd gradient;
    Eigen::MatrixXd hessian;
  };

  std::vector<Constraint> constraintsOf(const std::vector<FormEdge>& edges, double growth) const;
  Eigen::Index index(std::size_t form, Eigen::Index a, Eigen::Index b) const;
  Eigen::MatrixXd formOf(const Eigen::VectorXd& x, std::size_t form) const;
  Eigen::MatrixXd valueOf(const Constraint& constraint, const Eigen::VectorXd& x) const;
  double cost(const std::vector<Constraint>& constraints, const Eigen::VectorXd& x, double weight) const;
  void addSlope(const Constraint& constraint, Slope& slope) const;
  bool step(const std::vector<Constraint>& constraints, double weight);

  double& t() { return x_(x_.size() - 1); }

  Eigen::Index size_, per_form_;
  std::size_t forms_;
  Eigen::VectorXd x_;  // lower triangles of the forms, then t
};

}  // namespace jackal_aic
