#pragma once

/// @file
/// Prediction errors, free energy and its gradients (eq. 3-4..3-15) over any generative model: pure functions of
/// mu_tilde (states x (p+1)) and y_tilde (sensors x (p+1)). D is the shift operator.

#include "jackal_aic/aic/generalized_motion.hpp"
#include "jackal_aic/aic/generative_model.hpp"

namespace jackal_aic {

/// Both prediction errors (3-8).
template <class Model>
struct PredictionErrors {
  typename Model::Measurement sensory;  ///< eps_y, unit of the channel per s^i
  typename Model::Belief state;         ///< eps_mu, unit of the state per s^(i+1)
};

/// eps_y = y_tilde - R mu_tilde (3-6).
template <class Model>
typename Model::Measurement sensoryPredictionError(const Model& model, const typename Model::Belief& belief,
                                                   const typename Model::Measurement& measurement) {
  typename Model::Measurement error = measurement;
  error.noalias() -= model.sensory_map.lazyProduct(belief);
  return error;
}

/// eps_mu = D mu_tilde + (mu_tilde - mu_d_tilde) / tau (3-7).
template <class Model>
typename Model::Belief statePredictionError(const Model& model, const typename Model::Belief& belief,
                                            const typename Model::Belief& set_point) {
  return shiftOrders(belief) + (belief - set_point) / model.tau;
}

/// Both prediction errors (3-8).
template <class Model>
PredictionErrors<Model> predictionErrors(const Model& model, const typename Model::Belief& belief,
                                         const typename Model::Measurement& measurement,
                                         const typename Model::Belief& set_point) {
  return {sensoryPredictionError(model, belief, measurement), statePredictionError(model, belief, set_point)};
}

/// F = 1/2 eps' Pi eps (3-10); the constant -1/2 ln|Pi| is left out because the precisions are fixed.
template <class Model>
double freeEnergy(const Model& model, const PredictionErrors<Model>& errors) {
  return 0.5 * model.sensory_precision.cwiseProduct(errors.sensory).cwiseProduct(errors.sensory).sum() +
         0.5 * model.state_precision.cwiseProduct(errors.state).cwiseProduct(errors.state).sum();
}

/// dF/d(mu_tilde) = E' Pi_mu eps_mu - R' Pi_y eps_y, with E' = D' + I/tau (the bracket of 3-11).
template <class Model>
typename Model::Belief beliefGradient(const Model& model, const PredictionErrors<Model>& errors) {
  const typename Model::Belief weighted_state = model.state_precision.cwiseProduct(errors.state);
  const typename Model::Measurement weighted_sensory = model.sensory_precision.cwiseProduct(errors.sensory);
  typename Model::Belief gradient = shiftOrdersTransposed(weighted_state) + weighted_state / model.tau;
  gradient.noalias() -= model.sensory_map.transpose().lazyProduct(weighted_sensory);
  return gradient;
}

/// d(mu_tilde)/dt = D mu_tilde - kappa_mu dF/d(mu_tilde) (3-11).
template <class Model>
typename Model::Belief beliefDerivative(const Model& model, double kappa_mu, const typename Model::Belief& belief,
                                        const typename Model::Measurement& measurement,
                                        const typename Model::Belief& set_point) {
  return shiftOrders(belief) -
         kappa_mu * beliefGradient(model, predictionErrors(model, belief, measurement, set_point));
}

/// dF/da = K Pi_y eps_y, summed over the orders that drive the action (3-13 with the forward model of 3-14). The
/// printed 3-15 stacks one block per order for a single action; the Jackal's model has the block of order 0 alone,
/// which reproduces the thesis' measurements.
template <class Model>
typename Model::Action actionGradient(const Model& model, const typename Model::Measurement& sensory_error) {
  const typename Model::Measurement weighted = model.sensory_precision.cwiseProduct(sensory_error);
  typename Model::Action gradient = model.forward_model * weighted.col(0);
  for (int i = 1; i <= model.action_orders; ++i) gradient += model.forward_model * weighted.col(i);
  return gradient;
}

}  // namespace jackal_aic
