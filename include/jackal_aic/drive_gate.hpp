#pragma once

/// @file
/// The drive gate between the action and the motors: decides whether the robot may move, and bounds how fast.

#include <limits>

#include "jackal_aic/parameters.hpp"
#include "jackal_aic/skid_steer_kinematics.hpp"
#include "jackal_aic/types.hpp"

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
};

/// What the gate lets the robot do.
enum class DriveStatus {
  idle,     ///< nothing to follow was ever received: zero command
  driving,  ///< the limited action is driven
  stopped   ///< an input is missing or too old: zero command
};

/// Status with the reason why the robot does not drive.
struct GateDecision {
  DriveStatus status;
  const char* reason;  ///< static text; empty while driving
};

/// Limits and deadlines of the drive command. Pure: what it returns depends on the arguments alone.
class DriveGate {
 public:
  DriveGate(const LimitParameters& limits, const DeadlineParameters& deadlines, const GeometryParameters& geometry)
      : limits_(limits), deadlines_(deadlines), kinematics_(geometry) {}

  /// Decides from the ages of the inputs. An input older than its deadline, or stamped further ahead than that, stops.
  GateDecision decide(const InputAges& ages) const;

  /// Bounds a command: forward speed and yaw rate each to its limit, then both wheels by one factor to the wheel speed
  /// limit, which keeps the curvature. A command that is not finite becomes zero.
  WheelCommand limit(const WheelCommand& wanted) const;

 private:
  LimitParameters limits_;
  DeadlineParameters deadlines_;
  SkidSteerKinematics kinematics_;
};

}  // namespace jackal_aic
