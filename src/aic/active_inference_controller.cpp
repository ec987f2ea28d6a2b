#include "jackal_aic/aic/active_inference_controller.hpp"

#include <cmath>

#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {
namespace {

/// Half the period of the sensors; without a plant model, of the action.
double shortestGap(const ControllerParameters& controller, const std::optional<PlantModel>& model) {
  return 0.5 / (model ? model->sensor_rate : controller.action_rate);
}

InferenceGains gainsOf(const ControllerParameters& p) {
  return {p.kappa_mu, p.kappa_a, p.beliefStep(), p.actionStep(), p.integrator};
}

}  // namespace

ActiveInferenceController::ActiveInferenceController(const ControllerParameters& controller,
                                                     const GeometryParameters& geometry,
                                                     const std::optional<PlantModel>& plant_model,
                                                     Divergence divergence)
    : parameters_(validate(controller, geometry, divergence)),
      kinematics_(geometry),
      inference_(GenerativeModel(controller, geometry), gainsOf(controller)),
      sensors_(controller.orders, shortestGap(controller, plant_model), thresholds::kGap),
      bound_(plant_model && !controller.printed
                 ? std::make_optional<ActionBound>(*plant_model, geometry, controller.actionStep())
                 : std::nullopt) {}

SampleVerdict ActiveInferenceController::observe(const Observation& observation) {
  const std::optional<Observation> complete = reconstructed(observation, kinematics_);
  if (!complete) return SampleVerdict::incomplete;
  const SampleVerdict verdict = sensors_.update(complete->stamp, complete->vector());  // ỹ  (3-22)
  if (!taken(verdict)) return verdict;
  inference_.observe(sensors_.measurement());
  if (verdict == SampleVerdict::restarted) {
    if (bound_) bound_->resetMeasurements();
    inference_.restartBelief();  // the action continues from the driven command, which a gap does not affect
  }
  if (bound_) bound_->observe(*complete, observation.valid);
  return verdict;
}

void ActiveInferenceController::updateBelief() {
  if (sensors_.hasMeasurement()) inference_.updateBelief();  // μ̃  (3-11)
}

WheelCommand ActiveInferenceController::updateAction() {
  if (!sensors_.hasMeasurement()) return action();
  const WheelVector driven = inference_.action();
  const WheelVector wanted = inference_.updateAction();  // a  (3-13)
  if (!bound_) return action();
  const BodyVector mu_d = inference_.setPoint().col(0);
  const WheelVector goal = kinematics_.wheelSpeeds(mu_d(kForward), mu_d(kYaw)).vector();
  bound_->apply(driven);
  const WheelVector bounded = bound_->bound(driven, wanted, goal);
  const double most = standstill_.largestCommand(goal.isZero(0.0), bounded, wheelSpeeds(), actionStep());
  inference_.hold({limited(bounded(0), most), limited(bounded(1), most)});
  return action();
}

void ActiveInferenceController::hold(const WheelCommand& applied) { inference_.hold(applied.vector()); }

void ActiveInferenceController::overrule(const WheelCommand& applied) {
  inference_.restartBelief();
  if (bound_) bound_->apply(inference_.action());
  hold(applied);
  // Another source drives, so the robot does not count as standing at the hand-over.
  standstill_.largestCommand(false, applied.vector(), wheelSpeeds(), actionStep());
}

void ActiveInferenceController::adoptGains(const ControllerParameters& controller, const GeometryParameters& geometry) {
  requireUnchanged("controller.orders", controller.orders, parameters_.orders);
  requireUnchanged("controller.action_rate", controller.action_rate, parameters_.action_rate);
  requireUnchanged("controller.belief_rate", controller.belief_rate, parameters_.belief_rate);
  requireUnchanged("controller.printed", controller.printed, parameters_.printed);
  validate(controller, geometry);
  ActiveInference<GenerativeModel> adopted(GenerativeModel(controller, geometry), gainsOf(controller));
  adopted.continueFrom(inference_);
  inference_ = adopted;
  parameters_ = controller;
  kinematics_ = SkidSteerKinematics(geometry);
}

std::optional<Observation> reconstructed(const Observation& observation, const SkidSteerKinematics& kinematics) {
  const ChannelValidity& valid = observation.valid;
  if (valid.yaw_rate + valid.wheel_left + valid.wheel_right < 2) return std::nullopt;
  Observation complete = observation;
  complete.valid = ChannelValidity{};
  if (!valid.acceleration) complete.acceleration_x = complete.acceleration_y = 0.0;
  const double difference = observation.yaw_rate / kinematics.yawPerDifference();  // omega_R - omega_L [rad/s]
  if (!valid.yaw_rate) {
    complete.yaw_rate = kinematics.bodyVelocity({observation.wheel_left, observation.wheel_right})(kYaw);
  } else if (!valid.wheel_left) {
    complete.wheel_left = observation.wheel_right - difference;
  } else if (!valid.wheel_right) {
    complete.wheel_right = observation.wheel_left + difference;
  }
  return complete;
}

bool ActiveInferenceController::setSetPoint(const SetPoint& set_point) {
  if (!set_point.vector().allFinite()) return false;
  inference_.setSetPoint(set_point.vector());
  return true;
}

void ActiveInferenceController::restart() {
  inference_.restartBelief();
  hold({});
}

void ActiveInferenceController::reset() {
  sensors_.reset();
  inference_.observe(sensors_.measurement());
  inference_.setSetPoint(BodyVector::Zero());
  if (bound_) bound_->reset();
  standstill_ = {};
  restart();
}

}  // namespace jackal_aic
