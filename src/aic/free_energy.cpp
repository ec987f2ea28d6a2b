#include "jackal_aic/aic/free_energy.hpp"

#include "jackal_aic/aic/generalized_motion.hpp"

namespace jackal_aic {

GeneralizedSensor sensoryPredictionError(const GenerativeModel& model, const GeneralizedBody& belief,
                                         const GeneralizedSensor& measurement) {
  GeneralizedSensor error = measurement;
  error.noalias() -= model.sensory_map.lazyProduct(belief);
  return error;
}

GeneralizedBody statePredictionError(const GenerativeModel& model, const GeneralizedBody& belief,
                                     const GeneralizedBody& set_point) {
  return shiftOrders(belief) + (belief - set_point) / model.tau;
}

PredictionErrors predictionErrors(const GenerativeModel& model, const GeneralizedBody& belief,
                                  const GeneralizedSensor& measurement, const GeneralizedBody& set_point) {
  return {sensoryPredictionError(model, belief, measurement), statePredictionError(model, belief, set_point)};
}

double freeEnergy(const GenerativeModel& model, const PredictionErrors& errors) {
  return 0.5 * model.weighted(errors.sensory).cwiseProduct(errors.sensory).sum() +
         0.5 * model.weighted(errors.state).cwiseProduct(errors.state).sum();
}

GeneralizedBody beliefGradient(const GenerativeModel& model, const PredictionErrors& errors) {
  const GeneralizedBody weighted_state = model.weighted(errors.state);
  const GeneralizedSensor weighted_sensory = model.weighted(errors.sensory);
  // E' Π_μ ε_μ − R' Π_y ε_y, with E' = D' + I/τ
  GeneralizedBody gradient = shiftOrdersTransposed(weighted_state) + weighted_state / model.tau;
  gradient.noalias() -= model.sensory_map.transpose().lazyProduct(weighted_sensory);
  return gradient;
}

WheelVector actionGradient(const GenerativeModel& model, const GeneralizedSensor& sensory_error) {
  return model.forward_model * model.weighted(sensory_error).col(0);
}

GeneralizedBody beliefDerivative(const GenerativeModel& model, double kappa_mu, const GeneralizedBody& belief,
                                 const GeneralizedSensor& measurement, const GeneralizedBody& set_point) {
  const PredictionErrors errors = predictionErrors(model, belief, measurement, set_point);
  return shiftOrders(belief) - kappa_mu * beliefGradient(model, errors);
}

}  // namespace jackal_aic
