#pragma once

/// @file
/// The algorithm of the thesis (section 3-3) over any generative model (generative_model.hpp):
///
///     believe  d mu_tilde/dt = D mu_tilde - kappa_mu (E' Pi_mu eps_mu - R' Pi_y eps_y)    (3-11)  at the belief rate
///     act      da/dt = -kappa_a K Pi_y eps_y                                              (3-13)  at the action rate
///
/// with eps_y = y_tilde - R mu_tilde and eps_mu = E mu_tilde - mu_d_tilde / tau, E = D + I / tau.

#include "jackal_aic/aic/belief_update.hpp"
#include "jackal_aic/aic/free_energy.hpp"
#include "jackal_aic/aic/generative_model.hpp"

namespace jackal_aic {

/// Learning rates and steps of belief and action.
struct InferenceGains {
  double kappa_mu;                            ///< learning rate of the belief update
  double kappa_a;                             ///< learning rate of the action update
  double belief_step;                         ///< h of the belief update [s]
  double action_step;                         ///< h of the action update [s]
  Integrator integrator = Integrator::exact;  ///< of the belief update
};

/// Belief and action that descend the free energy of one model. The caller keeps the time. With fixed-size models only
/// the constructor allocates.
template <class Model>
class ActiveInference {
 public:
  using Belief = typename Model::Belief;            ///< mu_tilde
  using Measurement = typename Model::Measurement;  ///< y_tilde
  using State = typename Model::State;              ///< mu
  using Action = typename Model::Action;            ///< a

  /// Starts with belief, set point, measurement and action of zero.
  ActiveInference(const Model& model, const InferenceGains& gains)
      : model_(model),
        gains_(gains),
        belief_update_(model, gains.kappa_mu, gains.belief_step, gains.integrator),
        mu_(model.still()),
        mu_d_(mu_),
        input_(mu_),
        y_(model.silence()),
        a_(Action::Zero(model.forward_model.rows())),
        sensory_inverse_(leastSquares(model.sensory_map)) {}

  /// Desired state mu_d.
  void setSetPoint(const State& mu_d) {
    mu_d_.col(0) = mu_d;
    input_ = belief_update_.input(y_, mu_d_);
  }

  /// Takes a generalised measurement y_tilde (3-22, Generalization, or sensors that measure derivatives).
  void observe(const Measurement& y) {
    y_ = y;
    input_ = belief_update_.input(y_, mu_d_);
  }

  /// One step of the belief with measurement and set point held.
  void updateBelief() { belief_update_.step(mu_, input_); }  // μ̃  (3-11)

  /// One step of the action by forward Euler.
  const Action& updateAction() {
    // a ← a − h κ_a K Π_y ε_y                                                   (3-13, 5-1)
    a_ -= gains_.action_step * gains_.kappa_a * actionGradient(model_, sensoryPredictionError(model_, mu_, y_));
    return a_;
  }

  /// Sets the belief from the measurement by least squares, with derivatives zero.
  void restartBelief() {
    mu_.setZero();
    mu_.col(0) = sensory_inverse_ * y_.col(0);
  }

  void hold(const Action& applied) { a_ = applied; }  ///< replaces the action by the command that was applied

  /// Copies belief, action, set point and measurement of another one with the same sizes.
  void continueFrom(const ActiveInference& other) {
    mu_ = other.mu_;
    mu_d_ = other.mu_d_;
    a_ = other.a_;
    observe(other.y_);
  }

  const Model& model() const { return model_; }          ///< as given
  const Belief& belief() const { return mu_; }           ///< mu_tilde
  const Belief& setPoint() const { return mu_d_; }       ///< mu_d_tilde
  const Measurement& measurement() const { return y_; }  ///< y_tilde
  const Action& action() const { return a_; }            ///< a

  /// eps_y, eps_mu now (3-6, 3-7).
  PredictionErrors<Model> errors() const { return predictionErrors(model_, mu_, y_, mu_d_); }

 private:
  Model model_;
  InferenceGains gains_;
  BeliefUpdate<Model> belief_update_;
  Belief mu_, mu_d_;
  Belief input_;  // Gamma b: what measurement and set point add to the belief in every step
  Measurement y_;
  Action a_;
  Eigen::Matrix<double, Belief::RowsAtCompileTime, Measurement::RowsAtCompileTime> sensory_inverse_;  // least squares
};

}  // namespace jackal_aic
