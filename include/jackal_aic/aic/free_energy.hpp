#pragma once

/// @file
/// Prediction errors, free energy and its gradients (eq. 3-4..3-10, 3-13): pure functions.
///
/// With mu_tilde (3 x (p+1)), y_tilde (5 x (p+1)), D the shift operator, E = D + I/tau:
///
///     eps_y  = y_tilde - R mu_tilde                          (3-6)
///     eps_mu = E mu_tilde - mu_d_tilde / tau                 (3-7)
///     F      = 1/2 eps_y' Pi_y eps_y + 1/2 eps_mu' Pi_mu eps_mu    (3-10)

#include "jackal_aic/aic/generative_model.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Both prediction errors.
struct PredictionErrors {
  GeneralizedSensor sensory;  ///< eps_y, 5 x (p+1), unit of the channel per s^i
  GeneralizedBody state;      ///< eps_mu, 3 x (p+1), unit of the body velocity per s^(i+1)
};

/// eps_y = y_tilde - R mu_tilde (3-6).
GeneralizedSensor sensoryPredictionError(const GenerativeModel& model, const GeneralizedBody& belief,
                                         const GeneralizedSensor& measurement);

/// eps_mu = D mu_tilde + (mu_tilde - mu_d_tilde) / tau (3-7).
GeneralizedBody statePredictionError(const GenerativeModel& model, const GeneralizedBody& belief,
                                     const GeneralizedBody& set_point);

/// Both prediction errors (3-8).
PredictionErrors predictionErrors(const GenerativeModel& model, const GeneralizedBody& belief,
                                  const GeneralizedSensor& measurement, const GeneralizedBody& set_point);

/// F = 1/2 eps' Pi eps (3-10); the constant -1/2 ln|Pi| is left out because the precisions are fixed.
double freeEnergy(const GenerativeModel& model, const PredictionErrors& errors);

/// dF/d(mu_tilde) = E' Pi_mu eps_mu - R' Pi_y eps_y, 3 x (p+1) (the bracket of 3-11).
GeneralizedBody beliefGradient(const GenerativeModel& model, const PredictionErrors& errors);

/// dF/da = K (Pi_y_tilde eps_y), the block of order 0 (3-13 with the forward model of 3-14). The printed 3-15 stacks
/// one block per order for a single action; only the block of order 0 is used, which is what reproduces the thesis'
/// measurements.
WheelVector actionGradient(const GenerativeModel& model, const GeneralizedSensor& sensory_error);

/// d(mu_tilde)/dt = D mu_tilde - kappa_mu dF/d(mu_tilde) (3-11).
GeneralizedBody beliefDerivative(const GenerativeModel& model, double kappa_mu, const GeneralizedBody& belief,
                                 const GeneralizedSensor& measurement, const GeneralizedBody& set_point);

}  // namespace jackal_aic
