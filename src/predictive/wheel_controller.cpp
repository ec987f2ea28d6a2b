#include "jackal_aic/predictive/wheel_controller.hpp"

namespace jackal_aic {

WheelController::WheelController(const PredictiveParameters& parameters, const PlantModel& model, double wheel_radius)
    : gain_(model.gain),
      learning_rate_(parameters.action_learning_rate),
      belief_(model, wheel_radius, wheelBeliefParameters(parameters)),
      path_(model, wheel_radius, parameters.reference_time, 1.0 / parameters.action_rate) {}

void WheelController::act(double input) {
  path_.take(input);
  // a ← a − κ_a (∂²F/∂a²)⁻¹ ∂F/∂a with F = ½ ε_a²/Σ_a, ε_a = g a + d − w*
  const double error = gain_ * action_ + belief_.disturbance() - input;
  action_ -= learning_rate_ * error / gain_;
}

void WheelController::hold(double applied) {
  path_.amend(gain_ * (applied - action_));
  action_ = applied;
}

void WheelController::overrule(double applied) {
  path_.follow(gain_ * applied + belief_.disturbance());
  action_ = applied;
}

void WheelController::stand() {
  action_ = 0.0;
  path_.reset(0.0);
}

void WheelController::restart(double measured) {
  action_ = 0.0;
  path_.reset(measured);
  belief_.seed(measured);
}

void WheelController::setParameters(const PredictiveParameters& parameters) {
  learning_rate_ = parameters.action_learning_rate;
  belief_.setParameters(wheelBeliefParameters(parameters));
  path_.setReferenceTime(parameters.reference_time);
}

}  // namespace jackal_aic
