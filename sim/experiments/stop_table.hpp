#pragma once

/// @file
/// Every preset from rest to a set point and back to rest, on robots whose acceleration limit is and is not the
/// model's: how far the response overshoots, and whether a robot told to stop runs back.

#include <string>
#include <vector>

#include "loop_setup.hpp"
#include "stop_figures.hpp"

namespace jackal_aic::sim {

/// A step from rest and the stop after it.
struct StopCase {
  std::string controller;
  std::string plant;          ///< box or ground
  double limit_factor = 1.0;  ///< acceleration limit of the robot / of the model
  SetPoint set_point;         ///< from kRestTime until the stop
};

/// What came of a StopCase.
struct StopOutcome {
  StopFigures figures;
  double without_limit_pct = 0.0;  ///< of a turn on the ground: the excess on a robot whose motors have no limit, which
                                   ///< is what the effective track makes of it; else 0
};

/// Bars of a case by its preset and the limit of its robot: overshoot of 5, 10 or 12 %; with motors slower than the
/// model's 15 % and the bars of a robot off its model.
StopBars barsOf(const StopCase& stop_case);

/// True if excess and stop keep the bars; ripple and settling are shown elsewhere. What a robot without limit does in a
/// turn on the ground is no wind-up: the effective track of a skid-steer robot depends on its motion.
bool keeps(const StopOutcome& outcome, const StopBars& bars);

/// Every preset of an active inference controller at 0.1..2 m/s, 0.5..2 rad/s and arcs of both, on ground and box, with
/// robots of 0.5, 0.7, 0.8 and 0.9 times the model's acceleration limit, the model's and twice that.
std::vector<StopCase> stopCases();

/// Runs a case with the limits of the drive command that the robot has (config/jackal.yaml). @param overrides further
/// settings, e.g. of the plant.
StopOutcome runCase(const PackageFiles& files, const StopCase& stop_case, const Overrides& overrides = {});

/// The case in words, e.g. for a message.
std::string nameOf(const StopCase& stop_case);

/// Runs every case and writes stops.csv into a directory; returns how many do not keep their bars. @param jobs threads;
/// 0: one per core.
std::size_t writeStopTable(const PackageFiles& files, const std::string& directory, const Overrides& overrides,
                           unsigned jobs);

}  // namespace jackal_aic::sim
