#pragma once

/// @file
/// Recordings of real skid-steer robots as CSV files, and what reached their motors.
///
/// Two kinds, told apart by their columns: continuous logs (time_s, state, command_*, wheel_*, gyro_z_radps, accel_*,
/// lidar_*), in which the command is known only while `state` is `calib`, and windows of 2 s (window, calib_step,
/// steady, time_s, cmd_*, wheel_*, ...), of which those of one calib_step follow each other.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "jackal_aic/identification/plant_identification.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic::sim {

/// Dimensions of a recorded robot, known by the name of its files.
struct RecordedRobot {
  const char* prefix;     ///< that the name of a file begins with
  double wheel_radius;    ///< r [m]
  double wheel_distance;  ///< between the left and the right wheels [m]
};

/// One row of a recording.
struct RecordedSample {
  Observation observation;  ///< stamp [s] is that of the recording's own clock, on which stretches are apart
  bool starts = false;      ///< begins a stretch: what was before is not known, or somebody else drove
  std::optional<WheelCommand> command;  ///< as recorded [rad/s]; empty while somebody drives who is not recorded
  int step = -1;                        ///< which step of the commands it belongs to; -1: none
  bool steady = false;                  ///< belongs to the later part of its step
  double heading = 0.0;                 ///< by lidar, of the world's or the window's frame [rad]
};

/// A recording.
struct RobotRecording {
  std::string name;            ///< of its file, without extension and what a terminal would obey
  RecordedRobot robot;         ///< dimensions
  bool has_imu = true;         ///< false: gyro and accelerometer of the file are zero throughout
  bool gyro_reversed = false;  ///< the file's gyro, not its wheels, has the other sign, which `samples` have right
  std::vector<RecordedSample> samples;

  double duration() const;  ///< of all samples [s]
};

/// Reads a recording. @throws ParameterError, one line with file, line, column and value, if the name begins with no
/// known robot, the columns are of neither kind, a field is no finite number or beyond +-1e10, or time runs back.
RobotRecording readRecording(const std::string& path);

/// Recordings of a directory: its regular files *.csv by name. @throws ParameterError if there is none.
std::vector<std::string> recordingsIn(const std::string& directory);

/// Means over a steady piece of kLength samples.
struct SteadyBlock {
  static constexpr std::size_t kLength = 40;  ///< 2 s at 20 Hz
  int step;                                   ///< of the commands
  WheelCommand command;                       ///< as recorded [rad/s]
  WheelCommand wheels;                        ///< measured [rad/s]
  double yaw_rate;                            ///< by the gyro; by lidar where there is none [rad/s]
};

/// The steady pieces of the steps, in order.
std::vector<SteadyBlock> steadyBlocks(const RobotRecording& recording);

/// What the robot's own software makes of a recorded command before its motors get it. The recordings hold the command
/// that was sent, in units of the sender's kinematics; the robot scales it, cuts it, and lets forward speed and turn
/// change only so fast (a Husky turns no faster than 1.0 rad/s and gets there in ramps of 2 rad/s^2, and slows both
/// sides where one would exceed its speed). A monitor on the robot sees what the motors get, so its replay has to:
/// against the recorded command its alarms would be right, because the wheels do not follow that.
struct CommandPath {
  double forward_gain = 1.0;             ///< of the mean of the sides
  double yaw_gain = 1.0;                 ///< of the difference of the sides
  double largest_difference = 1e3;       ///< between the sides, |omega_R - omega_L| [rad/s]
  double largest_wheel_speed = 1e3;      ///< of either side; the other is slowed by the same factor [rad/s]
  double largest_forward_rate = 1e6;     ///< at which the mean of the sides changes [rad/s^2]
  double largest_difference_rate = 1e6;  ///< at which the difference of the sides changes [rad/s^2]

  /// What the motors get of a recorded command in the end.
  WheelCommand applied(const WheelCommand& recorded) const;
};

/// The path that explains a recording best, by the least sum of absolute errors, because here and there something holds
/// the wheels up: gains and cuts from the steady pieces, rates from all known commands. Straight through if there are
/// fewer than 8 pieces, or if the wheels stand or turn against the commands: a path that cuts these to nothing would
/// hide from identification and monitors what is wrong.
CommandPath fitCommandPath(const RobotRecording& recording);

/// What the motors got, for every sample; empty where that is not known. A stretch begins with the speeds of its
/// wheels.
std::vector<std::optional<WheelCommand>> appliedCommands(const RobotRecording& recording, const CommandPath& path);

/// The part of a recording with known commands before a sample, for identifyDriveTrain(): its stretches as
/// far apart as they were. @param end index of the sample.
DriveRecording driveRecording(const RobotRecording& recording, const CommandPath& path, std::size_t end);

}  // namespace jackal_aic::sim
