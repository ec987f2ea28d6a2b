#pragma once

/// @file
/// The generative model of the controller: how sensations follow from the belief, how the belief should move, and how
/// much each is trusted.

#include <Eigen/Core>

#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Linear generative model: sensory map g(mu) = R mu (3-3), attractor state dynamics f(mu) = (mu_d - mu)/tau (2-3), and
/// the precisions Pi = 1/Sigma of both.
struct GenerativeModel {
  /// Builds the model from gains and geometry, which have to be valid (see validate()).
  GenerativeModel(const ControllerParameters& controller, const GeometryParameters& geometry);

  /// Highest generalised order p.
  int orders() const { return static_cast<int>(state_precision.cols()) - 1; }

  /// Number of generalised coordinates of the belief, 3 (p+1).
  int beliefSize() const { return kBodySize * (orders() + 1); }

  double tau;                                                 ///< temporal parameter [s]
  Eigen::Matrix<double, kSensorSize, kBodySize> sensory_map;  ///< R (3-4)
  Eigen::Matrix<double, 2, kSensorSize> forward_model;        ///< K (3-14)
  GeneralizedBody state_precision;      ///< diagonal of Pi_mu, 3 x (p+1), element by element of mu_tilde
  GeneralizedSensor sensory_precision;  ///< diagonal of Pi_y, 5 x (p+1), element by element of y_tilde

  /// Pi_mu_tilde eps, 3 x (p+1).
  GeneralizedBody weighted(const GeneralizedBody& state_error) const {
    return state_precision.cwiseProduct(state_error);
  }

  /// Pi_y_tilde eps, 5 x (p+1).
  GeneralizedSensor weighted(const GeneralizedSensor& sensory_error) const {
    return sensory_precision.cwiseProduct(sensory_error);
  }
};

}  // namespace jackal_aic
