#pragma once

/// @file
/// Recordings of real robots through the library's drive loop: what its fault detection says of robots without a fault,
/// and what its controller learns of their slip.

#include <optional>
#include <string>
#include <vector>

#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/predictive/slip_belief.hpp"
#include "package_files.hpp"
#include "robot_recording.hpp"

namespace jackal_aic::sim {

/// What the loop knows of the robot's drive train.
enum class RealModel {
  assumed,    ///< what is assumed of a robot that has not been identified (config/jackal_model.yaml)
  identified  ///< identifyDriveTrain() on the first half of the recording
};

/// An alarm in a recording, in which every one is false.
struct RealAlarm {
  double time;         ///< at which it began [s]
  std::string reason;  ///< in the words of the drive loop's status
};

/// What the loop makes of a gyro that reads the turn with the wrong sign.
struct ReversedGyro {
  std::optional<double> told;  ///< time at which it said so first [s]; empty if it did not
  SlipState slip;              ///< as learned in spite of it; as configured if nothing was
};

/// What came of the replay of a recording.
struct RealFigures {
  PlantModel model;               ///< that was replayed with
  std::string refusal;            ///< why the recording identifies nothing; empty if it does
  std::size_t samples = 0;        ///< of the sensors
  double duration = 0.0;          ///< [s]
  std::vector<RealAlarm> alarms;  ///< times in which a channel or a drive counted as faulty, or the robot would stop
  double alarmed = 0.0;           ///< part of the samples in such a time
  /// Root mean square of the yaw rate's error over the steady pieces of held-out steps [rad/s]: with the slip that the
  /// controller had learned at the end, and with the constant track that fits the other steps best. Empty without a
  /// gyro to learn from, without such steps, or where the body never turned.
  std::optional<double> yaw_error;
  std::optional<double> constant_error;  ///< see yaw_error
  std::optional<ReversedGyro> reversed;  ///< if the file's gyro is: what came of the replay with it as it is there
};

/// Replays a recording in its order through a drive loop with the predictive controller, its fault detection on and the
/// motors shared with somebody else: the recorded command is what reached the motors, and where it is not known, the
/// wheels tell. Every second step of the commands is held out: nothing is learned of the slip in it. A part that does
/// not follow on the one before starts the loop anew. Where the identification refuses, what is assumed is replayed, as
/// a robot would drive.
/// @param path from the commands to the wheels, as fitCommandPath() found it in the recording.
RealFigures replay(const PackageFiles& files, const RobotRecording& recording, const CommandPath& path,
                   RealModel model);

/// Replays a recording as replay(), with its gyro reversed.
ReversedGyro replayReversed(const PackageFiles& files, const RobotRecording& recording, const CommandPath& path,
                            RealModel model);

/// Replays all recordings of a directory with both models and prints a row for each. @param csv file for the same
/// figures; empty: none. @param jobs threads; 0: one per core. @returns the line that sums it up, "false alarms: N; yaw
/// error / best constant: worst R". @throws ParameterError as recordingsIn() and readRecording().
std::string replayRealDrives(const PackageFiles& files, const std::string& directory, const std::string& csv,
                             unsigned jobs);

}  // namespace jackal_aic::sim
