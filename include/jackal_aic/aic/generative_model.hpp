#pragma once

/// @file
/// The generative model: sensory map, state dynamics, and the precisions of both.

#include <Eigen/Core>

#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Linear generative model of any robot: sensory map g(mu) = R mu (3-3), state dynamics f(mu) = (mu_d - mu)/tau (2-3)
/// with the set point as attractor, and the precisions Pi = 1/Sigma of both. The numbers of states, sensors and actions
/// and the highest order are compile-time constants, or Eigen::Dynamic.
template <int states, int sensors, int actions, int max_orders = kMaxOrders>
struct LinearModel {
  using State = Eigen::Matrix<double, states, 1>;                ///< mu
  using Action = Eigen::Matrix<double, actions, 1>;              ///< a
  using Belief = Generalized<states, max_orders>;                ///< mu_tilde and mu_d_tilde
  using Measurement = Generalized<sensors, max_orders>;          ///< y_tilde
  using SensoryMap = Eigen::Matrix<double, sensors, states>;     ///< R
  using ForwardModel = Eigen::Matrix<double, actions, sensors>;  ///< K

  double tau;                     ///< temporal parameter [s]
  SensoryMap sensory_map;         ///< R (3-4)
  ForwardModel forward_model;     ///< K (3-14)
  Belief state_precision;         ///< diagonal of Pi_mu, element by element of mu_tilde
  Measurement sensory_precision;  ///< diagonal of Pi_y, element by element of y_tilde; 0: not measured
  int action_orders = 0;          ///< highest order whose sensory error drives the action (3-15)

  /// Number of generalised coordinates of the belief, states x (p+1).
  int beliefSize() const { return static_cast<int>(state_precision.size()); }

  /// A belief or set point of zero.
  Belief still() const { return Belief::Zero(state_precision.rows(), state_precision.cols()); }

  /// A measurement of zero.
  Measurement silence() const { return Measurement::Zero(sensory_precision.rows(), sensory_precision.cols()); }
};

/// The Jackal's: body velocity, gyro, wheels and accelerometer, two wheel speeds; the action descends order 0 alone.
struct GenerativeModel : LinearModel<kBodySize, kSensorSize, 2> {
  /// Builds the model from gains and geometry, which have to be valid (see validate()).
  GenerativeModel(const ControllerParameters& controller, const GeometryParameters& geometry);
};

}  // namespace jackal_aic
