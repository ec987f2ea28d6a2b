#pragma once

/// @file
/// Action update (eq. 3-13): the wheel speeds descend the free energy.

#include "jackal_aic/aic/action_bound.hpp"
#include "jackal_aic/aic/generative_model.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Integrates da/dt = -kappa_a K Pi_y (y - R mu) (3-13, order 0) by forward Euler (2-11). The action is an integrator;
/// it stays within what the motors can follow (action_bound.hpp), and hold() sets it to what was really driven, so that
/// it does not wind up at a limit.
class ActionUpdate {
 public:
  /// @param kappa_a learning rate; @param step length of an action step [s].
  ActionUpdate(double kappa_a, double step, const ActionBound& bound) : kappa_a_(kappa_a), step_(step), bound_(bound) {}

  /// Advances the action by one step and returns it. @param sensory_error eps_y, 5 x (p+1); @param goal wheel speeds of
  /// the set point.
  WheelCommand step(const GenerativeModel& model, const GeneralizedSensor& sensory_error, const WheelCommand& goal);

  /// Replaces the action by the command that was really applied.
  void hold(const WheelCommand& applied) { action_ = applied.vector(); }

  /// Goes on with another learning rate.
  void setLearningRate(double kappa_a) { kappa_a_ = kappa_a; }

  /// Lets an action step pass in which another command is applied.
  void overrule(const WheelCommand& applied);

  /// What the motors can follow.
  ActionBound& bound() { return bound_; }

  /// The action a: wheel speeds [rad/s].
  WheelCommand action() const { return WheelCommand::from(action_); }

 private:
  double kappa_a_;
  double step_;
  ActionBound bound_;
  WheelVector action_ = WheelVector::Zero();
};

}  // namespace jackal_aic
