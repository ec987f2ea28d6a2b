#pragma once

/// @file
/// Robots that nobody has identified, driven by joystick with what is assumed of them (config/jackal_model.yaml):
/// whether they oscillate, and whether the fault monitor calls them faulty.

#include <cstdint>
#include <string>
#include <vector>

#include "monitored_loop.hpp"
#include "quiet_hours.hpp"

namespace jackal_aic::sim {

/// What is assumed of a robot that nobody has identified. @throws ParameterError if the file is not there or not right.
PlantModel assumedModel(const PackageFiles& files);

/// The robot as assumed, and the corners of what it may be instead: half and twice the dead time and the lag, gain 0.8
/// and 1.2, half, the same and three times the acceleration limit.
std::vector<DriveTrainRatios> unidentifiedRobots();

/// What became of a robot.
struct UnidentifiedDrive {
  int swings = 0;          ///< most in one time of constant set point
  std::size_t faults = 0;  ///< reported by the fault monitor
  std::string first;       ///< of them, with its time; empty if there was none

  /// True if it goes on swinging while the set point stays: more than there and back and there again.
  bool oscillates() const { return swings > kMostSwings; }

  static constexpr int kMostSwings = 3;
};

/// Swings of a drive: turning points of the true forward speed or yaw rate, further than 0.05 m/s or 0.15 rad/s from
/// the last, while the set point stays, from two seconds after its change on; the most in one such time.
int mostSwings(const std::vector<MonitoredSample>& samples);

/// Drives a robot by joystick. @param controller a preset; @param duration [s].
UnidentifiedDrive driveUnidentified(const PackageFiles& files, const std::string& controller,
                                    const DriveTrainRatios& robot, double duration, std::uint64_t seed);

/// Drives all of them and writes unidentified.csv into a directory. Returns the line that sums it up: "oscillating: K,
/// with faults: K of N robots". @param jobs threads; 0: one per core.
std::string writeUnidentifiedTable(const PackageFiles& files, const std::string& controller, double duration,
                                   std::uint64_t seed, const std::string& directory, unsigned jobs);

}  // namespace jackal_aic::sim
