#pragma once

/// @file
/// The verdict on one run of the fault campaign, from what was recorded of it. Pure.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/safety/gate_parameters.hpp"
#include "scenario.hpp"

namespace jackal_aic::sim {

/// True motion of the robot.
struct TruthSample {
  double time = 0.0;      ///< [s]
  double forward = 0.0;   ///< x_dot in base_link [m/s]
  double yaw_rate = 0.0;  ///< theta_dot [rad/s]
};

/// A drive command as the controller sent it.
struct CommandSample {
  double time = 0.0;    ///< of arrival [s]
  WheelCommand speeds;  ///< [rad/s]
  /// Whether it is the first of a new controller process after an end we asked for, or since the world started anew:
  /// there the robot is at rest, and the command has to be zero, whatever it was before.
  bool fresh_start = false;
};

/// What the controller said about itself.
struct StateSample {
  double time = 0.0;                        ///< [s]
  bool driving = false;                     ///< whether it says that it drives
  std::string text;                         ///< status and reason
  std::uint32_t rejected_set_points = 0;    ///< since its start
  std::uint32_t rejected_measurements = 0;  ///< since its start
};

/// A warning or error on /diagnostics.
struct DiagnosticSample {
  double time = 0.0;  ///< [s]
  std::string text;   ///< message and values
};

/// All that was recorded of a run, each series in the order of its times.
struct RunRecord {
  std::vector<TruthSample> truth;
  std::vector<CommandSample> commands;
  std::vector<StateSample> states;
  std::vector<DiagnosticSample> diagnostics;
  std::string breakdown;  ///< why the run could not be completed, or a crash; empty if neither
};

/// What the robot and its controller are configured for: what the bars follow from.
struct CampaignLimits {
  GateParameters gate;               ///< of the drive gate
  GeometryParameters geometry;       ///< of the controller
  double action_period = 0.02;       ///< of the drive commands [s]
  double robot_dead_time = 0.08;     ///< from a command to the motors [s]
  double robot_acceleration = 1.65;  ///< what the robot's motors can do, of the wheel circumference [m/s^2]
};

/// Figures and verdict of a run.
struct Verdict {
  double distance = 0.0;                 ///< travelled from the onset until standstill or the end of the faults [m]
  std::optional<double> standstill;      ///< from the onset until the robot stands [s]; empty if it drives on
  double allowed_standstill = 0.0;       ///< bar of it [s]; see allowedStandstill()
  double command_step = 0.0;             ///< largest change of a wheel's command from one period to the next [rad/s]
  double acceleration_use = 0.0;         ///< largest change of the body command, relative to the gate's limit
  double limit_use = 0.0;                ///< largest drive command, relative to the limit of speed, yaw rate or wheel
  double overspeed = 0.0;                ///< largest speed beyond that at the onset and the set point [m/s]
  double yaw_overspeed = 0.0;            ///< as overspeed, of the yaw rate [rad/s]
  std::optional<double> detected_after;  ///< from the onset [s]; empty if nothing told of the fault
  std::string history;                   ///< what the controller said about itself: each change with its time
  std::string told;                      ///< what told of it
  std::vector<std::string> failures;     ///< what was not as it has to be; empty if all was

  /// Those of the failures that no fault excuses: a run that broke down or was not recorded, and drive commands that
  /// are not finite, not within the limits or go on after a fresh start.
  std::vector<std::string> unsound;

  bool passed() const { return failures.empty(); }  ///< every bar is met
};

/// Longest time from the onset to standstill: 1.2 x (configured time until the brake begins + time to brake), plus the
/// robot's dead time, which no controller can shorten. The time to brake is the gate's, or the robot's own where its
/// motors are slower than the gate's brake.
double allowedStandstill(const Expectation& expectation, const CampaignLimits& limits, const TruthSample& at_onset);

/// Judges a run.
Verdict judge(const Scenario& scenario, const RunRecord& record, const CampaignLimits& limits);

}  // namespace jackal_aic::sim
