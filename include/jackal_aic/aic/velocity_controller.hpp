#pragma once

/// @file
/// Interface of the controllers of the body velocity. The node and the closed loop without ROS drive a robot through
/// it.

#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Controller of the body velocity. The caller keeps the time: it calls observe() when a measurement
/// arrives, updateBelief() every beliefStep() and, after the belief, one of the following every actionStep():
///
///     driving             hold(gate(updateAction()))    the action as far as the robot may follow it
///     stopped or braking  overrule(command)             another command instead of the action
///
/// Nothing of this allocates or throws.
class VelocityController {
 public:
  virtual ~VelocityController() = default;

  /// Desired body velocity mu_d (base_link). A set point that is not finite is refused (false) and changes nothing.
  virtual bool setSetPoint(const SetPoint& set_point) = 0;

  /// Takes a measurement. A refused one changes nothing. The first one seeds the belief.
  virtual SampleVerdict observe(const Observation& observation) = 0;

  /// One step of the belief; nothing before the first measurement.
  virtual void updateBelief() = 0;

  /// One step of the action; returns the wheel speeds to drive, zero before the first measurement.
  virtual WheelCommand updateAction() = 0;

  /// Takes the part of the last action that is really driven, so that the action does not wind up beyond a limit.
  virtual void hold(const WheelCommand& applied) = 0;

  /// Takes the command that is driven in this action period instead of the action. The belief keeps following the
  /// robot, and the next action starts from this command, without a jump.
  virtual void overrule(const WheelCommand& applied) = 0;

  /// Starts again from the last measurement with zero action.
  virtual void restart() = 0;

  /// Forgets everything except the parameters.
  virtual void reset() = 0;

  /// Forgets all measurements and the motion, after a clock jump; keeps what was learned about the robot.
  virtual void resetMotion() { reset(); }

  virtual bool hasBelief() const { return true; }   ///< false if it drives open loop
  virtual BodyVector believedVelocity() const = 0;  ///< belief about the body velocity now (base_link)
  virtual WheelCommand action() const = 0;          ///< a [rad/s]
  virtual double freeEnergy() const = 0;            ///< F now
  virtual double beliefStep() const = 0;            ///< time between belief updates [s]
  virtual int beliefStepsPerAction() const = 0;     ///< belief updates per action update
  double actionStep() const { return beliefStepsPerAction() * beliefStep(); }  ///< time between action updates [s]

 protected:
  VelocityController() = default;
  VelocityController(const VelocityController&) = default;             ///< copies a whole controller
  VelocityController& operator=(const VelocityController&) = default;  ///< copies a whole controller
};

}  // namespace jackal_aic
