#pragma once

/// @file
/// Causes that keep the robot from driving.

#include <bitset>
#include <cstddef>

namespace jackal_aic {

/// Why the robot may not drive, from mild to severe: of several causes the last one counts.
enum class StopCause {
  none,
  start,              ///< set points have been sent since before the start, without a zero or a pause
  unpaired,           ///< no pair within robot.pairing_tolerance
  moved,              ///< pushed or carried: wheels turn under a zero command, or the body slides
  imu_frozen,         ///< IMU data repeat exactly
  imu_late,           ///< past deadlines.imu
  imu_missing,        ///< never received
  wheels_frozen,      ///< wheel speeds repeat exactly on the move
  feedback_late,      ///< past deadlines.feedback
  wheels_late,        ///< past deadlines.wheels
  wheels_missing,     ///< never received
  set_point_late,     ///< past deadlines.set_point
  set_point_missing,  ///< never received
  set_points_rival,   ///< both send within 0.5 s
  clock_jump,         ///< the clock jumped back
  graph_unchecked,    ///< the ROS graph was not read yet, or e_stop is not connected
  motors_off,         ///< feedback: the motors do not take velocity commands
  robot_stopped,      ///< status: the robot's own stop is engaged
  emergency_stop,     ///< e_stop
  disabled,           ///< service enable: false
  shutdown,           ///< the controller ends
  contention,         ///< on the topic of the commands
  sensor_fault,       ///< too few channels without a fault
  belief_diverged,    ///< not finite, or beyond plausibility.speed_factor
  driver_fault        ///< feedback: a motor driver reports a fault
};

/// Number of causes, `none` included.
inline constexpr int kStopCauses = static_cast<int>(StopCause::driver_fault) + 1;

/// Reaction to a cause.
enum class Severity {
  stop,       ///< brake; drive on when the cause is gone
  emergency,  ///< brake at the acceleration limits; drive on when the cause is gone
  halt,       ///< as emergency, by a person or the robot; then wait for restart_after_stop
  fault       ///< as emergency; then wait for a zero set point
};

/// Severity of a cause; `none` counts as stop.
Severity severity(StopCause cause);

/// Text for people; empty for `none`.
const char* text(StopCause cause);

/// What to do about it: the second sentence of a log line; empty for `none`, and if the text says it.
const char* remedy(StopCause cause);

/// Causes that are present.
class StopCauses {
 public:
  /// Adds a cause if a condition holds; returns itself for the next one.
  StopCauses& add(StopCause cause, bool present) {
    if (present) set_.set(static_cast<std::size_t>(cause));
    return *this;
  }

  /// Adds the causes of another set.
  StopCauses& add(const StopCauses& causes) {
    set_ |= causes.set_;
    return *this;
  }

  /// The cause that counts, or `none`.
  StopCause worst() const;

 private:
  std::bitset<kStopCauses> set_;
};

}  // namespace jackal_aic
