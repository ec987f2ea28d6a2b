#pragma once

/// @file
/// What all structures tell of a drive loop in ControllerState.

#include <jackal_aic/ControllerState.h>
#include <ros/time.h>

#include <limits>
#include <string>

#include "jackal_aic/safety/drive_loop.hpp"

namespace jackal_aic {

/// A drive loop at one time. Of fixed size: it may be handed from one thread to another.
struct LoopState {
  ros::Time stamp;
  DriveLoopStatus status;
  SetPoint set_point;  ///< in force
  BodyVector measured =
      BodyVector::Constant(std::numeric_limits<double>::quiet_NaN());  ///< by the wheels, and the gyro; NaN: not yet
  WheelCommand action;                                                 ///< before the limits [rad/s]
  WheelCommand command;                                                ///< [rad/s]
};

/// The loop as it is now. @param measured as in LoopState.
LoopState loopState(const DriveLoop& loop, const BodyVector& measured, const ros::Time& stamp);

/// Fills in everything but what belongs to the structure. BY_NOBODY while the command is zero, else BY_US.
/// @param reason for which the robot is not driven, as StatusReport has it; @param frame of the body velocity.
void fillState(const LoopState& state, const std::string& reason, const std::string& frame, ControllerState& message);

/// Structure, status and driver of a state in words: "predictive, driving, driven by this controller".
std::string summary(const ControllerState& state);

}  // namespace jackal_aic
