#pragma once

/// @file
/// Identification of a drive train from a recorded drive. Dead time, lag, gain and acceleration limit follow from
/// commands and wheel speeds, the effective track of each turn direction from wheel speeds and yaw rate.
///
/// Model of each wheel, with command u, speed w, wheel radius r:
///
///     dw/dt = clamp( (target - w) / lag, +- acceleration_limit / r ),
///     target = sign(u) max(0, gain |u| - offset),  u = u(t - dead_time)
///
/// fitted to all wheel speeds at once by least squares. Motors with an offset turn slower than commanded by a fixed
/// amount, and stand below it (clearpath_robot#280). Recordings are cut at gaps and where the commands do not explain
/// the driving. Confidence intervals are those of the linearised fit with residuals that are correlated over a second
/// (cluster-robust, Liang and Zeger 1986). They cover both drive trains if left and right, or forward and backward,
/// differ, and fresh and old wheel speeds if a driver repeats them.

#include <stdexcept>
#include <string>
#include <vector>

#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// A recording is not usable. what() is one line with the reason.
class IdentificationError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A wheel command at the time it was sent [s].
struct CommandSample {
  double time;           ///< [s]
  WheelCommand command;  ///< wheel speeds that were commanded [rad/s]
};

/// Measured wheel speeds with their stamp [s].
struct WheelSample {
  double time;         ///< [s]
  WheelCommand speed;  ///< measured wheel speeds [rad/s]
};

/// Measured yaw rate [rad/s] with its stamp [s].
struct YawSample {
  double time;      ///< [s]
  double yaw_rate;  ///< theta_dot [rad/s]
};

/// One recorded drive. All series share one clock and are in order of time.
struct DriveRecording {
  std::vector<CommandSample> commands;      ///< commands
  std::vector<WheelSample> wheels;          ///< wheel speeds
  std::vector<YawSample> yaw;               ///< may be empty: then the effective track stays unknown
  std::string yaw_unknown = "no IMU data";  ///< why yaw is empty, if it is
  std::vector<std::string> remarks;         ///< remarks of its source, one line each; identification repeats them
};

/// An estimated quantity.
struct Estimate {
  double value = 0.0;                             ///< estimate, in the unit of the quantity
  double half_width = 0.0;                        ///< half width of the 95 % confidence interval
  std::string unknown;                            ///< why it is unknown; empty if it is known
  bool known() const { return unknown.empty(); }  ///< true if estimated

  /// Known to be above zero: its confidence interval does not reach down to it.
  bool significant() const { return known() && value > half_width; }
};

/// Estimates of the drive train.
struct Identification {
  Estimate dead_time;           ///< [s]
  Estimate lag;                 ///< [s]
  Estimate gain;                ///< change of the wheel speed / change of the command, above the offset
  Estimate offset;              ///< by which the wheels turn slower than gain x command [rad/s]
  Estimate acceleration_limit;  ///< of the wheel circumference [m/s^2]; where unknown, value is the largest one seen
  Estimate track_left;          ///< effective track turning left (theta_dot > 0) [m]
  Estimate track_right;         ///< effective track turning right [m]
  double residual = 0.0;        ///< root mean square of measured minus fitted wheel speed [rad/s]
  double r_squared = 0.0;       ///< share of the variance of the wheel speeds that the model explains
  double sensor_rate = 50.0;    ///< of wheel speeds, or of the yaw rate where that is lower, rounded [Hz]
  double duration = 0.0;        ///< from the first wheel sample to the last [s]
  std::vector<std::string> remarks;  ///< remarks for the user, one line each
  std::vector<WheelSample> fitted;   ///< wheel speeds of the fitted model at the stamps of the measured ones
};

/// Identifies the drive train. @param wheel_radius r [m]; @param slip_factor alpha: wheels and gyro determine the ratio
/// alpha / b_hat only (3-1), so the effective track belongs to this slip factor.
/// @throws IdentificationError if a series is missing or too short, stamps are not increasing, a value is not finite,
/// or the commands hardly change (no excitation). Also if a wheel never turns, turns against its command or follows
/// that of the other side. Also if the model leaves more than a tenth of the variance of the wheel speeds, or the
/// commands do not explain half of the recording. Also if an estimate is at the end of the range searched, or the
/// wheels answer before their commands.
Identification identifyDriveTrain(const DriveRecording& recording, double wheel_radius, double slip_factor = 1.0);

}  // namespace jackal_aic
