#pragma once

/// @file
/// The active inference controller of the thesis (section 3-3), without ROS, clock or I/O.
///
///     sense    y_tilde  <- generalise(y)                                                    (3-22)   at the sensor
///     rate believe  d mu_tilde/dt = D mu_tilde - kappa_mu (E' Pi_mu eps_mu - R' Pi_y eps_y)      (3-11)   at the
///     belief rate act      da/dt = -kappa_a K Pi_y eps_y                                                (3-13)   at
///     the action rate
///
/// with eps_y = y_tilde - R mu_tilde and eps_mu = E mu_tilde - mu_d_tilde / tau, E = D + I / tau.

#include "jackal_aic/action_update.hpp"
#include "jackal_aic/belief_update.hpp"
#include "jackal_aic/free_energy.hpp"
#include "jackal_aic/generalized_motion.hpp"
#include "jackal_aic/generative_model.hpp"
#include "jackal_aic/parameters.hpp"
#include "jackal_aic/types.hpp"

namespace jackal_aic {

/// Active inference velocity controller of a skid-steer robot. The caller keeps the time: it calls observe() when a
/// measurement arrives, updateBelief() every 1/belief_rate and updateAction() every 1/action_rate, the belief first
/// where both fall together. None of these allocates or throws.
///
/// The belief is drawn towards the set point by construction and equals it at rest of the loop whatever the robot does;
/// it is the controller's state, not an estimate of the robot's velocity.
class ActiveInferenceController {
 public:
  /// @throws ParameterError if the gains are invalid for this geometry (see validate()).
  ActiveInferenceController(const ControllerParameters& controller, const GeometryParameters& geometry,
                            Divergence divergence = Divergence::refused);

  /// Desired body velocity mu_d (base_link). A set point that is not finite is refused (false) and changes nothing.
  bool setSetPoint(const SetPoint& set_point);

  /// Takes a measurement. A refused one changes nothing. The first one, and the first after a gap, seeds the belief.
  SampleVerdict observe(const Observation& observation);

  /// One step of the belief update (3-11) with the last measurement and set point held; nothing before the first
  /// measurement.
  void updateBelief();

  /// One step of the action update (3-13); returns the wheel speeds to drive.
  WheelCommand updateAction();

  /// Tells which command was really driven, so that the action does not wind up beyond a limit.
  void hold(const WheelCommand& applied);

  /// Takes other gains over and goes on with the present belief, action and measurements, so that the command does not
  /// jump. Allocates. @throws ParameterError, and changes nothing, if they are invalid or have another number of
  /// orders.
  void adoptGains(const ControllerParameters& controller, const GeometryParameters& geometry);

  /// Starts anew from the present motion: belief from the last measurement with derivatives zero, action zero.
  void restart();

  /// Forgets everything: measurements, set point, belief and action.
  void reset();

  const GeneralizedBody& belief() const { return mu_; }                            ///< mu_tilde, 3 x (p+1)
  const GeneralizedSensor& measurement() const { return sensors_.measurement(); }  ///< y_tilde, 5 x (p+1)
  WheelCommand action() const { return action_update_.action(); }                  ///< a [rad/s]
  PredictionErrors errors() const;                                                 ///< eps_y, eps_mu now (3-6, 3-7)
  double freeEnergy() const;                                                       ///< F now (3-10)

 private:
  GenerativeModel model_;
  Eigen::Matrix<double, kBodySize, kSensorSize> sensory_inverse_;  // least squares, to seed the belief
  Generalization sensors_;
  BeliefUpdate belief_update_;
  ActionUpdate action_update_;
  GeneralizedBody mu_;
  GeneralizedBody mu_d_;
};

}  // namespace jackal_aic
