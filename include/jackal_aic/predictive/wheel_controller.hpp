#pragma once

/// @file
/// Perception and action for the wheels of one side:
///
///     believe   x = (w, z, d) from the commands really applied and the measured speed          (wheel_belief.hpp)
///     refer     w*, the input that takes the drive train along the reference model's path (drive_train_reference.hpp)
///     act       v <- v - kappa_a (d2F/dv2)^-1 dF/dv,  F = 1/2 eps_a^2 / Sigma_a,  eps_a = gain v + d - w*
///     command   a, whose effective part behind the motors' dead zone is v; a = v without one     (DeadZone)
///
/// So the action cancels the believed disturbance, within the range of possible motors. Because of the dead time the
/// present measurement does not depend on the present action: only the expected error eps_a has a gradient.

#include "jackal_aic/model/drive_train.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/wheel_belief.hpp"
#include "jackal_aic/predictive/drive_train_reference.hpp"
#include "jackal_aic/predictive/predictive_parameters.hpp"

namespace jackal_aic {

/// Belief, reference and action of one side. Nothing here allocates.
class WheelController {
 public:
  /// @param wheel_radius r [m].
  WheelController(const PredictiveParameters& parameters, const PlantModel& model, double wheel_radius);

  /// Moves the belief by WheelBelief::kStep, during which the action is applied.
  void predict() { belief_.predict(action_); }

  /// Takes a measurement, as WheelBelief::correct().
  double correct(double measurement, double added_variance = 0.0) {
    return belief_.correct(measurement, added_variance);
  }

  /// The input w* [rad/s] towards a wheel speed [rad/s] in the next action period.
  double input(double wanted) const { return path_.input(wanted); }

  /// One action step with this input w* [rad/s].
  void act(double input);

  /// Changes the action to this effective command [rad/s].
  void limit(double effective) { drive(dead_zone_.command(effective), effective); }

  /// Takes the driven part of the last action [rad/s]; the path continues from it.
  void hold(double applied);

  /// Takes the command that is driven in an action period instead of the action [rad/s].
  void overrule(double applied);

  /// Bounds the effective command [rad/s] of a wheel that has to stand.
  void rest(double most);

  /// Sets the first measured speed [rad/s], as steady, because the commands so far are unknown.
  void reset(double measured) { belief_.reset(measured); }

  /// Restarts from a measured speed [rad/s] with action zero; the commands under way stay.
  void restart(double measured);

  /// Adopts other gains. @param model of the drive train, as it was configured.
  void setParameters(const PredictiveParameters& parameters, const PlantModel& model);

  /// Adopts another dead time, lag and acceleration limit of the drive train.
  void setDriveTrain(const PlantModel& model, double wheel_radius);

  /// As WheelBelief::setTurning().
  void setTurning(double share) { belief_.setTurning(share); }

  const WheelBelief& belief() const { return belief_; }      ///< about speed and disturbance
  const DriveTrainReference& path() const { return path_; }  ///< towards the wanted speed
  double action() const { return action_; }                  ///< command now driven, a [rad/s]
  double effectiveAction() const { return effective_; }      ///< its effective part behind the dead zone, v [rad/s]

 private:
  void drive(double applied, double effective);

  double configured_gain_;  // about which commands are bounded
  double gain_;             // wheel speed / effective command
  DeadZone dead_zone_;      // of the motors
  double learning_rate_;    // kappa_a
  WheelBelief belief_;
  DriveTrainReference path_;
  double action_ = 0.0;     // a
  double effective_ = 0.0;  // v
};

}  // namespace jackal_aic
