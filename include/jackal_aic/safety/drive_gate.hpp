#pragma once

/// @file
/// The drive gate between the action and the motors: decides in every action step whether the robot may move, brakes it
/// if not, and bounds how it moves.
///
///     idle -------- no cause ---------> driving
///     driving ----- a cause ----------> braking         (at rest already: stopped, faulted)
///     braking ----- zero command -----> stopped, or faulted after a fault, or idle without a set point
///     stopped ----- no cause ---------> driving
///     faulted ----- released ---------> driving, stopped or idle
///
/// A brake goes on to zero even if its cause is gone before. The gate has a latch that holds the robot at rest. It is
/// set from the start, by a fault, and by a stop of a person or of the robot (Severity::halt) with restart_after_stop:
/// acknowledged. At rest a zero set point releases it, or a pause of the set points, once its cause is gone, a fault
/// for brake.fault_hold: a set point that goes on meanwhile was meant for another robot than one that was stopped.

#include <limits>

#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/safety/command_limiter.hpp"
#include "jackal_aic/safety/gate_parameters.hpp"
#include "jackal_aic/safety/stop_cause.hpp"

namespace jackal_aic {

/// Age of something that was never received [s].
inline constexpr double kNever = std::numeric_limits<double>::infinity();

/// Age of each input of the controller [s]: the larger of the age of its stamp and the time since it arrived; kNever if
/// it was never received. A stamp in the future gives a negative age.
struct InputAges {
  double set_point = kNever;    ///< last valid set point
  double wheels = kNever;       ///< last valid wheel speeds
  double imu = kNever;          ///< last valid IMU sample
  double measurement = kNever;  ///< last pair of wheel speeds and IMU sample that the controller took
  double feedback = kNever;     ///< last feedback of the motors; kNever on a robot without
  double unpaired = kNever;     ///< time for which both sources have sent, and no pair was taken; 0 while one has not
};

/// True for something that came, and whose age is beyond its deadline on either side of now; 0: no deadline.
bool isLate(double age, double deadline);

/// Health of a source of measurements.
struct SourceHealth {
  bool missing = false;                             ///< never received
  bool late = false;                                ///< past its deadline
  bool frozen = false;                              ///< it repeats itself exactly
  bool silent() const { return missing || late; }   ///< nothing new comes
  bool lost() const { return silent() || frozen; }  ///< it does not count
};

/// Health of all measurements.
struct SensorHealth {
  SourceHealth wheels;    ///< of the encoders
  SourceHealth imu;       ///< of gyro and accelerometer
  bool unpaired = false;  ///< no pair of both was taken for longer than their deadlines allow
};

/// Health that follows from the ages of the inputs; whether a source is frozen is left to the caller. One older than
/// its deadline, or stamped further ahead than that, is late.
SensorHealth sensorHealth(const InputAges& ages, const DeadlineParameters& deadlines);

/// Every loss as a cause to stop.
StopCauses lossCauses(const SensorHealth& health);

/// Causes that follow from the ages of set point and feedback. One older than its deadline, or stamped further ahead
/// than that, stops; so does a set point that was never received.
StopCauses overdueInputs(const InputAges& ages, const DeadlineParameters& deadlines);

/// False if a belief is not finite, or beyond plausibility.speed_factor times the speed limits; an infinite factor
/// switches this check off.
/// @param belief believed body velocity (base_link); @param free_energy F.
bool isPlausible(const BodyVector& belief, double free_energy, const GateParameters& parameters);

/// Set point in multiples of the speed limits beyond which it is an error.
inline constexpr double kAbsurdSetPoint = 100.0;

/// False if a set point is beyond kAbsurdSetPoint times the speed limits, or not finite: it is to be refused, while one
/// that is only too fast is to be scaled into the limits.
bool isPlausible(const SetPoint& set_point, const LimitParameters& limits);

/// What the gate lets the robot do.
enum class DriveStatus {
  idle,     ///< nothing to follow was ever received: zero command
  driving,  ///< the limited action is driven
  stopped,  ///< at rest until the cause is gone: zero command
  braking,  ///< on the way to rest
  faulted   ///< at rest until the fault is gone and acknowledged: zero command
};

/// What an action step has to go by.
struct GateInputs {
  StopCauses causes;              ///< what is wrong now
  bool set_point_at_rest = true;  ///< the set point is zero, or they pause: releases the latch
};

/// Outcome of an action step.
struct GateDecision {
  DriveStatus status = DriveStatus::idle;  ///< what the robot may do in this step
  StopCause cause = StopCause::none;       ///< that counts; also while it waits for its acknowledgement
  bool unacknowledged = false;             ///< the cause is gone, and its latch waits for a zero set point or a pause
};

/// State machine and limits of the drive command. In every action step call decide() first, then either drive() with
/// the action, if the status is driving, or brake(). Pure: no clock, no I/O, no allocation.
class DriveGate {
 public:
  /// @param period time from one action step to the next [s].
  DriveGate(const GateParameters& parameters, const GeometryParameters& geometry, double period);

  /// Goes on by one action step.
  GateDecision decide(const GateInputs& inputs);

  /// The action within the limits: the command of this step while driving. An action that is not finite brakes and
  /// counts as a diverged belief in the next step.
  /// @param set_point to which the actions lead.
  WheelCommand drive(const WheelCommand& action, const SetPoint& set_point);

  /// While driving: another source had the motors, with this command, from which the next step goes on.
  void follow(const WheelCommand& applied) { limiter_.follow(applied); }

  /// The command of this step while not driving: the brake's, or zero.
  WheelCommand brake();

  /// The last command [rad/s].
  WheelCommand command() const { return limiter_.command(); }

  /// A set point within the speed limits, on the same curvature.
  SetPoint reachable(const SetPoint& wanted) const { return limiter_.reachable(wanted); }

  /// Restarts: idle, with a zero command and latched.
  void reset();

  /// Releases the latch of the start, and no other.
  void release();

 private:
  StopCause presentCause(const GateInputs& inputs);
  bool latches(StopCause cause) const;
  bool acknowledged(const GateInputs& inputs) const;

  GateParameters parameters_;
  CommandLimiter limiter_;
  double period_;
  GateDecision decision_;
  bool emergency_ = false;                // of the present brake
  StopCause latched_ = StopCause::start;  // last fault or stop, until it is acknowledged
  double gone_for_ = 0.0;                 // s, since the cause of latched_ is gone
  bool action_diverged_ = false;
};

}  // namespace jackal_aic
