#pragma once

/// @file
/// The active inference controller of the thesis on a Jackal, without ROS, clock or I/O. The algorithm is in
/// active_inference.hpp; this class adds the generalised measurement (3-22) and, unless it runs as printed, the bounds
/// of the action.

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

/// The observation with every channel valid: of yaw rate and wheel speeds one that is invalid is computed from the
/// other two (3-2), invalid accelerations are zero. Empty if two of the three are invalid. A lost wheel with precision
/// zero would leave its action 3 % of its gain, the yaw rate's share (r alpha / b_hat)^2 of K, and the robot would
/// swerve.
std::optional<Observation> reconstructed(const Observation& observation, const SkidSteerKinematics& kinematics);

/// The thesis' controller.
///
/// The belief is drawn towards the set point, and equals it in steady state at any true velocity. It is the
/// controller's state and a biased estimate of the robot's velocity.
class ActiveInferenceController : public VelocityController {
 public:
  /// @param plant_model model of the motors, which bounds the action (action_bound.hpp). Without it, or with
  /// controller.printed, the action is that of the thesis, which winds up when the motors do not follow.
  /// @throws ParameterError if the gains are invalid for this geometry (see validate()).
  ActiveInferenceController(const ControllerParameters& controller, const GeometryParameters& geometry,
                            const std::optional<PlantModel>& plant_model = {},
                            Divergence divergence = Divergence::refused);

  bool setSetPoint(const SetPoint& set_point) override;

  /// As the base; the first measurement after a gap also sets the belief.
  SampleVerdict observe(const Observation& observation) override;

  /// One step of the belief update (3-11) with the last measurement and set point held.
  void updateBelief() override;

  /// One step of the action update (3-13). With a plant model, a robot at rest with a zero set point gets a command of
  /// exactly zero (standstill.hpp).
  WheelCommand updateAction() override;

  void hold(const WheelCommand& applied) override;

  /// Sets the belief to the present motion. Otherwise it would move to the set point while the robot does not.
  void overrule(const WheelCommand& applied) override;

  /// Belief from the last measurement with derivatives zero, action zero.
  void restart() override;

  void reset() override;

  /// Adopts other gains and keeps belief, action and measurements, so that the command does not jump. Allocates.
  /// @throws ParameterError, and changes nothing, if they are invalid, or have another number of orders, another rate
  /// or another value of `printed`.
  void adoptGains(const ControllerParameters& controller, const GeometryParameters& geometry);

  const GeneralizedBody& belief() const { return inference_.belief(); }              ///< mu_tilde, 3 x (p+1)
  const GeneralizedSensor& measurement() const { return inference_.measurement(); }  ///< y_tilde, 5 x (p+1)
  PredictionErrors<GenerativeModel> errors() const { return inference_.errors(); }   ///< eps_y, eps_mu now (3-6, 3-7)

  BodyVector believedVelocity() const override { return belief().col(0); }
  WheelCommand action() const override { return WheelCommand::from(inference_.action()); }
  double freeEnergy() const override { return jackal_aic::freeEnergy(inference_.model(), errors()); }
  double beliefStep() const override { return parameters_.beliefStep(); }
  int beliefStepsPerAction() const override { return parameters_.beliefStepsPerAction(); }

 private:
  WheelVector wheelSpeeds() const { return measurement().col(0).segment<2>(kWheelLeft); }

  ControllerParameters parameters_;
  SkidSteerKinematics kinematics_;
  ActiveInference<GenerativeModel> inference_;
  Generalization<kSensorSize> sensors_;
  std::optional<ActionBound> bound_;  // with a plant model
  Standstill standstill_;             // the same
};

}  // namespace jackal_aic
