#include "jackal_aic/aic/active_inference_controller.hpp"

#include <fmt/format.h>

#include <Eigen/QR>

#include "jackal_aic/aic/sensor_reconstruction.hpp"
#include "jackal_aic/model/drive_train.hpp"

namespace jackal_aic {
namespace {

constexpr double kLongestGap = 0.2;  // s; differences over a longer gap say nothing about the present derivatives

/// Half the period of the sensors: of a robot that nobody has modelled, that of the action.
double shortestGap(const ControllerParameters& controller, const std::optional<PlantModel>& model) {
  return 0.5 / (model ? model->sensor_rate : controller.action_rate);
}

ControllerParameters validated(const ControllerParameters& controller, const GeometryParameters& geometry,
                               Divergence divergence) {
  validate(controller, geometry, divergence);
  return controller;
}

[[noreturn]] void refuseToChange(const char* key, double wanted, double running) {
  throw ParameterError(
      fmt::format("controller.{} = {:g}: must stay {:g} while the controller runs", key, wanted, running));
}

}  // namespace

ActiveInferenceController::ActiveInferenceController(const ControllerParameters& controller,
                                                     const GeometryParameters& geometry,
                                                     const std::optional<PlantModel>& plant_model,
                                                     Divergence divergence)
    : plant_model_(plant_model),
      kinematics_(geometry),
      model_(validated(controller, geometry, divergence), geometry),
      sensory_inverse_(Eigen::MatrixXd(model_.sensory_map).completeOrthogonalDecomposition().pseudoInverse()),
      sensors_(controller.orders, shortestGap(controller, plant_model), kLongestGap),
      belief_update_(model_, controller.kappa_mu, controller.beliefStep(), controller.integrator),
      action_update_(controller.kappa_a, controller.actionStep(),
                     ActionBound(plant_model, geometry.wheel_radius, controller.actionStep())),
      standstill_(plant_model ? std::make_optional<Standstill>() : std::nullopt),
      belief_step_(controller.beliefStep()),
      belief_steps_per_action_(controller.beliefStepsPerAction()),
      mu_(GeneralizedBody::Zero(kBodySize, controller.orders + 1)),
      mu_d_(mu_),
      held_input_(mu_) {}

SampleVerdict ActiveInferenceController::observe(const Observation& observation) {
  const std::optional<Observation> complete = reconstructed(observation, kinematics_);
  if (!complete) return SampleVerdict::incomplete;
  const SampleVerdict verdict = sensors_.update(*complete);  // ỹ                        (3-22)
  if (!taken(verdict)) return verdict;
  if (verdict == SampleVerdict::restarted) {
    action_update_.bound().forgetMeasurements();
    seedBelief();  // a gap says nothing against the command that is driven: the action goes on from there
  }
  action_update_.bound().observe(*complete, observation.valid);
  holdInputs();
  return verdict;
}

void ActiveInferenceController::updateBelief() {
  if (sensors_.hasMeasurement()) belief_update_.step(mu_, held_input_);  // μ̃  (3-11)
}

void ActiveInferenceController::holdInputs() { held_input_ = belief_update_.input(sensors_.measurement(), mu_d_); }

WheelCommand ActiveInferenceController::updateAction() {
  if (!sensors_.hasMeasurement()) return action();
  const WheelCommand goal = kinematics_.wheelSpeeds(mu_d_(kForward, 0), mu_d_(kYaw, 0));
  action_update_.step(model_, sensoryPredictionError(model_, mu_, sensors_.measurement()), goal);  // a  (3-13)
  const double most = largestCommand(mu_d_(kForward, 0) == 0.0 && mu_d_(kYaw, 0) == 0.0);
  action_update_.hold({limited(action().left, most), limited(action().right, most)});
  return action();
}

double ActiveInferenceController::largestCommand(bool told_to_stand) {
  if (!standstill_) return Standstill::kFree;
  const auto& y = sensors_.measurement();
  return standstill_->largestCommand(told_to_stand, action(), y(kWheelLeft, 0), y(kWheelRight, 0), actionStep());
}

void ActiveInferenceController::hold(const WheelCommand& applied) { action_update_.hold(applied); }

void ActiveInferenceController::overrule(const WheelCommand& applied) {
  seedBelief();
  action_update_.overrule(applied);
  // Whoever drives, the robot is under way: it does not stand when it is handed back.
  largestCommand(false);
}

void ActiveInferenceController::adoptGains(const ControllerParameters& controller, const GeometryParameters& geometry) {
  if (controller.orders != model_.orders()) refuseToChange("orders", controller.orders, model_.orders());
  if (controller.actionStep() != actionStep())
    refuseToChange("action_rate", controller.action_rate, 1.0 / actionStep());
  if (controller.beliefStep() != beliefStep())
    refuseToChange("belief_rate", controller.belief_rate, 1.0 / beliefStep());
  ActiveInferenceController adopted(controller, geometry, plant_model_);
  adopted.sensors_ = sensors_;
  adopted.action_update_ = action_update_;
  adopted.action_update_.setLearningRate(controller.kappa_a);
  adopted.standstill_ = standstill_;
  adopted.mu_ = mu_;
  adopted.mu_d_ = mu_d_;
  adopted.holdInputs();
  *this = adopted;
}

bool ActiveInferenceController::setSetPoint(const SetPoint& set_point) {
  if (!set_point.vector().allFinite()) return false;
  mu_d_.col(0) = set_point.vector();
  holdInputs();
  return true;
}

void ActiveInferenceController::seedBelief() {
  mu_.setZero();
  mu_.col(0) = sensory_inverse_ * sensors_.measurement().col(0);
}

void ActiveInferenceController::restart() {
  seedBelief();
  action_update_.hold({});
}

void ActiveInferenceController::reset() {
  sensors_.reset();
  mu_d_.setZero();
  action_update_.bound().reset();
  if (standstill_) standstill_.emplace();
  restart();
  holdInputs();
}

PredictionErrors ActiveInferenceController::errors() const {
  return predictionErrors(model_, mu_, sensors_.measurement(), mu_d_);
}

double ActiveInferenceController::freeEnergy() const { return jackal_aic::freeEnergy(model_, errors()); }

}  // namespace jackal_aic
