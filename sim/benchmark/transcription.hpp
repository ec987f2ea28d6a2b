#pragma once

/// @file
/// The belief update of the thesis as one writes it down from its equations with a matrix library: what the belief tick
/// is compared with.
///
///     d(mu_tilde)/dt = D mu_tilde - kappa_mu (E' Pi_mu eps_mu - R_tilde' Pi_y eps_y)    (3-11)
///     mu_tilde <- mu_tilde + h d(mu_tilde)/dt                                           (3-16)
///
/// Every matrix is made anew in every tick, of a size known at run time only, as published implementations of
/// generalised filtering do.

#include <Eigen/Core>

#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/model/geometry.hpp"

namespace jackal_aic::benchmark {

/// Belief update (3-11) with the thesis' forward Euler step (3-16) on stacked vectors.
class Transcription {
 public:
  /// @param controller gains; @param geometry of the robot.
  Transcription(const ControllerParameters& controller, const GeometryParameters& geometry);

  /// One step. @param belief mu_tilde, 3 (p+1), (mu, mu', ...); @param measurement y_tilde, 5 (p+1); @param set_point
  /// mu_d_tilde, 3 (p+1).
  void step(Eigen::VectorXd& belief, const Eigen::VectorXd& measurement, const Eigen::VectorXd& set_point) const;

 private:
  ControllerParameters controller_;
  Eigen::MatrixXd sensory_map_;  // R (3-4), 5 x 3
};

}  // namespace jackal_aic::benchmark
