#pragma once

/// @file
/// The drive gate between the action and the motors. In every action step it permits motion or brakes, and bounds the
/// command.
///
///     idle -------- no cause ---------> driving
///     driving ----- a cause ----------> braking         (at rest already: stopped, faulted)
///     braking ----- zero command -----> stopped, or faulted after a fault, or idle without a set point
///     stopped ----- no cause ---------> driving
///     faulted ----- released ---------> driving, stopped or idle
///
/// A brake continues to zero even if its cause ends before. A latch holds the robot at rest: after the start, a fault,
/// and with restart_after_stop: acknowledged a stop of a person or the robot (Severity::halt). At rest, once the cause
/// is gone (a fault for brake.fault_hold), a zero set point or a pause of the set points releases it.

#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/safety/command_limiter.hpp"
#include "jackal_aic/safety/gate_parameters.hpp"
#include "jackal_aic/safety/stop_cause.hpp"

namespace jackal_aic {

/// False if a belief is not finite, or beyond plausibility.speed_factor times the speed limits; an infinite factor
/// switches this check off.
/// @param belief believed body velocity (base_link); @param free_energy F.
bool isPlausible(const BodyVector& belief, double free_energy, const GateParameters& parameters);

/// Set point in multiples of the speed limits beyond which it is an error.
inline constexpr double kAbsurdSetPoint = 100.0;

/// False if a set point is beyond kAbsurdSetPoint times the speed limits, or not finite: it has to be refused; a
/// smaller excess is scaled into the limits.
bool isPlausible(const SetPoint& set_point, const LimitParameters& limits);

/// State of the gate.
enum class DriveStatus {
  idle,     ///< no set point: zero command
  driving,  ///< the limited action is driven
  stopped,  ///< at rest until the cause is gone: zero command
  braking,  ///< on the way to rest
  faulted   ///< at rest until the fault is gone and acknowledged: zero command
};

/// The status in a word: "driving".
const char* text(DriveStatus status);

/// Inputs of an action step.
struct GateInputs {
  StopCauses causes;              ///< present causes
  bool set_point_at_rest = true;  ///< the set point is zero or paused, which releases the latch
};

/// Outcome of an action step.
struct GateDecision {
  DriveStatus status = DriveStatus::idle;  ///< state in this step
  StopCause cause = StopCause::none;       ///< the worst cause; kept until acknowledged
  bool unacknowledged = false;             ///< the cause is gone, and its latch waits for a zero set point or a pause
};

/// State machine and limits of the drive command. In every action step call decide() first, then either drive() with
/// the action, if the status is driving, or brake(). Pure: no clock, no I/O, no allocation.
class DriveGate {
 public:
  /// @param period time from one action step to the next [s].
  DriveGate(const GateParameters& parameters, const GeometryParameters& geometry, double period);

  /// Advances by one action step.
  GateDecision decide(const GateInputs& inputs);

  /// The action within the limits: the command of this step while driving. An action that is not finite brakes and
  /// counts as a diverged belief in the next step.
  WheelCommand drive(const WheelCommand& action);

  /// While driving: another source drove the motors with this command; the next step continues from it.
  void follow(const WheelCommand& applied) { limiter_.follow(applied); }

  /// The command of this step while not driving: the brake's, or zero.
  WheelCommand brake();

  /// The last command [rad/s].
  WheelCommand command() const { return limiter_.command(); }

  /// A set point within the speed limits, on the same curvature.
  SetPoint reachable(const SetPoint& wanted) const { return limiter_.reachable(wanted); }

  /// Restarts: idle, with a zero command and latched.
  void reset();

  /// Releases only the latch of the start.
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
