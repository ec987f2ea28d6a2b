#pragma once

/// @file
/// The active inference controller of the thesis on a Jackal, without ROS, clock or I/O. The algorithm is
/// active_inference.hpp; beside it stand what the sensors' samples become (3-22), and, unless it runs as printed, what
/// bounds the action.

#include <optional>

#include "jackal_aic/aic/action_bound.hpp"
#include "jackal_aic/aic/active_inference.hpp"
#include "jackal_aic/aic/generalized_motion.hpp"
#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/aic/standstill.hpp"
#include "jackal_aic/aic/velocity_controller.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// The thesis' controller.
///
/// The belief is drawn towards the set point by construction and equals it at rest of the loop whatever the robot does;
/// it is the controller's state, not an estimate of the robot's velocity.
class ActiveInferenceController : public VelocityController {
 public:
  /// @param plant_model what the motors can follow, which bounds the action (action_bound.hpp); without it, or with
  /// controller.printed, the thesis' action as printed, which winds up where the motors do not follow.
  /// @throws ParameterError if the gains are invalid for this geometry (see validate()).
  ActiveInferenceController(const ControllerParameters& controller, const GeometryParameters& geometry,
                            const std::optional<PlantModel>& plant_model = {},
                            Divergence divergence = Divergence::refused);

  bool setSetPoint(const SetPoint& set_point) override;

  /// As the base; the first measurement after a gap seeds the belief anew, too.
  SampleVerdict observe(const Observation& observation) override;

  /// One step of the belief update (3-11) with the last measurement and set point held.
  void updateBelief() override;

  /// One step of the action update (3-13). With a plant model, a robot that is told to stand, and does, gets a command
  /// of exactly zero (standstill.hpp).
  WheelCommand updateAction() override;

  void hold(const WheelCommand& applied) override;

  /// The belief, which would run on to the set point while the robot does not, starts anew from the present motion.
  void overrule(const WheelCommand& applied) override;

  /// Belief from the last measurement with derivatives zero, action zero.
  void restart() override;

  void reset() override;

  /// Takes other gains over and goes on with the present belief, action and measurements, so that the command does not
  /// jump. Allocates. @throws ParameterError, and changes nothing, if they are invalid, or have another number of
  /// orders, another rate or another value of `printed`.
  void adoptGains(const ControllerParameters& controller, const GeometryParameters& geometry);

  const GeneralizedBody& belief() const { return inference_.belief(); }              ///< mu_tilde, 3 x (p+1)
  const GeneralizedSensor& measurement() const { return inference_.measurement(); }  ///< y_tilde, 5 x (p+1)
  const std::optional<PlantModel>& plantModel() const { return plant_model_; }       ///< what bounds the action
  PredictionErrors<GenerativeModel> errors() const { return inference_.errors(); }   ///< eps_y, eps_mu now (3-6, 3-7)

  BodyVector believedVelocity() const override { return belief().col(0); }
  WheelCommand action() const override { return WheelCommand::from(inference_.action()); }
  double freeEnergy() const override { return jackal_aic::freeEnergy(inference_.model(), errors()); }
  double beliefStep() const override { return parameters_.beliefStep(); }
  int beliefStepsPerAction() const override { return parameters_.beliefStepsPerAction(); }

 private:
  double largestCommand(bool told_to_stand);

  ControllerParameters parameters_;
  std::optional<PlantModel> plant_model_;
  SkidSteerKinematics kinematics_;
  ActiveInference<GenerativeModel> inference_;
  Generalization<kSensorSize> sensors_;
  ActionBound bound_;
  std::optional<Standstill> standstill_;  // with a plant model
};

}  // namespace jackal_aic
