#include "jackal_aic/predictive/wheel_controller.hpp"

#include <algorithm>
#include <cmath>

#include "jackal_aic/model/robot_range.hpp"

namespace jackal_aic {

WheelController::WheelController(const PredictiveParameters& parameters, const PlantModel& model, double wheel_radius)
    : configured_gain_(model.gain),
      gain_(model.gain),
      dead_zone_(model),
      learning_rate_(parameters.action_learning_rate),
      belief_(model, wheel_radius, wheelBeliefParameters(parameters, model)),
      path_(model, wheel_radius, parameters.reference_time, 1.0 / parameters.action_rate) {}

void WheelController::act(double input) {
  path_.follow(input);
  // v ← v − κ_a (∂²F/∂v²)⁻¹ ∂F/∂v with F = ½ ε_a²/Σ_a, ε_a = g v + d − w*
  const double error = gain_ * effective_ + belief_.disturbance() - input;
  const Range most = withinRange(input, input);  // of a robot with the configured gain
  const double next = effective_ - learning_rate_ * error / gain_;
  effective_ = std::clamp(next, std::min(effective_, most.low / configured_gain_),
                          std::max(effective_, most.high / configured_gain_));
  action_ = dead_zone_.command(effective_);
}

void WheelController::hold(double applied) {
  const double effective = dead_zone_.effective(applied);
  path_.amend(gain_ * (effective - effective_));
  drive(applied, effective);
}

void WheelController::overrule(double applied) {
  const double effective = dead_zone_.effective(applied);
  path_.follow(gain_ * effective + belief_.disturbance());
  drive(applied, effective);
}

void WheelController::drive(double applied, double effective) {
  action_ = applied;
  effective_ = effective;
}

void WheelController::rest(double most) {
  limit(limited(effective_, most));
  path_.reset(0.0);
}

void WheelController::restart(double measured) {
  drive(0.0, 0.0);
  path_.reset(measured);
  belief_.restart(measured);
}

void WheelController::setDriveTrain(const PlantModel& model, double wheel_radius) {
  gain_ = model.gain;
  belief_.setDriveTrain(model, wheel_radius);
  path_.setDriveTrain(model);
}

void WheelController::setParameters(const PredictiveParameters& parameters, const PlantModel& model) {
  learning_rate_ = parameters.action_learning_rate;
  belief_.setParameters(wheelBeliefParameters(parameters, model));
  path_.setReferenceTime(parameters.reference_time);
}

}  // namespace jackal_aic
