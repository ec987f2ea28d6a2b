#pragma once

/// @file
/// Hours of driving without a fault, in which the fault monitor has to keep quiet: who drives what, with which sensors
/// and how, drawn by seed.

#include <cstdint>
#include <string>

#include "detection_table.hpp"

namespace jackal_aic::sim {

/// Which robots are drawn.
enum class QuietRobots {
  identified,   ///< the monitor's model is the robot's, but for the acceleration limit, which is drawn x 0.5..3
  unidentified  ///< nobody identified them: dead time and lag half to twice the model's, gain 0.8..1.2, limit x 0.5..3
};

/// Drive train of a robot in multiples of its model's.
struct DriveTrainRatios {
  double dead_time = 1.0;
  double lag = 1.0;
  double gain = 1.0;
  double acceleration_limit = 1.0;
};

/// A robot with these multiples of its drive train.
PlantParameters scaled(PlantParameters plant, const DriveTrainRatios& ratios);

/// A healthy robot and what it does.
struct QuietDrive {
  std::string controller;   ///< a preset
  std::string plant;        ///< box, ground or real
  std::string motion;       ///< a few words
  Overrides overrides;      ///< of the plant: sensors and seed
  DriveTrainRatios robot;   ///< what the model does not know
  bool identified = true;   ///< whether the monitor's model counts as that of this robot
  SetPointProfile profile;  ///< of the whole drive
};

/// A hand at a joystick: forward, turning, both or neither, up to 1.5 m/s and 2 rad/s, with a stick that takes its
/// time.
/// @param duration [s].
SetPointProfile joystickDriving(std::uint64_t seed, double duration);

/// Draws the drive of a number from a seed: steady turns of 0.1..2 rad/s, circles, arcs, straight driving at 0.1..2
/// m/s, standing or a joystick; any preset, ground or box, encoders with steps of 0..0.1 rad/s and noise of 0..0.03
/// rad/s, stamps with and without jitter; in the real world instead robot, ground, sensors and network. Equal seed and
/// number give an equal drive. @param duration [s].
QuietDrive drawQuietDrive(std::uint64_t seed, std::uint64_t number, double duration, QuietRobots robots,
                          World world = World::simple);

/// What is drawn, in one line.
std::string describe(const QuietDrive& drive);

/// Drives and counts the faults that are reported.
Alarms runQuiet(const PackageFiles& files, const QuietDrive& drive);

/// A campaign of some hours, 30 minutes each drive; prints each drive with an alarm and, as the last line,
/// "false alarms: K in N hours". @param jobs threads; 0: one per core. @returns K.
/// @throws ParameterError if hours is not a positive multiple of a half.
std::size_t runQuietHours(const PackageFiles& files, double hours, std::uint64_t seed, QuietRobots robots,
                          unsigned jobs, World world = World::simple);

}  // namespace jackal_aic::sim
