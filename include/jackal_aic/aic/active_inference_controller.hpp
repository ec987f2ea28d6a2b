#pragma once

/// @file
/// The active inference controller of the thesis (section 3-3), without ROS, clock or I/O.
///
///     sense    y_tilde  <- generalise(y)                                                  (3-22)  at the sensor rate
///     believe  d mu_tilde/dt = D mu_tilde - kappa_mu (E' Pi_mu eps_mu - R' Pi_y eps_y)    (3-11)  at the belief rate
///     act      da/dt = -kappa_a K Pi_y eps_y                                              (3-13)  at the action rate
///
/// with eps_y = y_tilde - R mu_tilde and eps_mu = E mu_tilde - mu_d_tilde / tau, E = D + I / tau.

#include <optional>

#include "jackal_aic/aic/action_update.hpp"
#include "jackal_aic/aic/belief_update.hpp"
#include "jackal_aic/aic/free_energy.hpp"
#include "jackal_aic/aic/generalized_motion.hpp"
#include "jackal_aic/aic/generative_model.hpp"
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
  /// @param plant_model what the motors can follow, which bounds the action (action_bound.hpp); without it the thesis'
  /// action as printed, which winds up where the motors do not follow.
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
  /// orders or another action rate.
  void adoptGains(const ControllerParameters& controller, const GeometryParameters& geometry);

  const GeneralizedBody& belief() const { return mu_; }                            ///< mu_tilde, 3 x (p+1)
  const GeneralizedSensor& measurement() const { return sensors_.measurement(); }  ///< y_tilde, 5 x (p+1)
  const std::optional<PlantModel>& plantModel() const { return plant_model_; }     ///< what bounds the action
  PredictionErrors errors() const;                                                 ///< eps_y, eps_mu now (3-6, 3-7)

  BodyVector believedVelocity() const override { return mu_.col(0); }
  WheelCommand action() const override { return action_update_.action(); }
  double freeEnergy() const override;  ///< F now (3-10)
  double beliefStep() const override { return belief_step_; }
  int beliefStepsPerAction() const override { return belief_steps_per_action_; }

 private:
  void seedBelief();
  double largestCommand(bool told_to_stand);
  void holdInputs();

  std::optional<PlantModel> plant_model_;
  SkidSteerKinematics kinematics_;
  GenerativeModel model_;
  Eigen::Matrix<double, kBodySize, kSensorSize> sensory_inverse_;  // least squares, to seed the belief
  Generalization sensors_;
  BeliefUpdate belief_update_;
  ActionUpdate action_update_;
  std::optional<Standstill> standstill_;  // with a plant model
  double belief_step_;
  int belief_steps_per_action_;
  GeneralizedBody mu_;
  GeneralizedBody mu_d_;
  GeneralizedBody held_input_;  // what measurement and set point add to the belief in every step
};

}  // namespace jackal_aic
