#pragma once

/// @file
/// Every preset from rest to a set point and back to rest, on robots whose acceleration limit is and is not the
/// model's: how far the response overshoots, and whether a robot told to stop runs back.

#include <optional>
#include <string>
#include <vector>

#include "closed_loop.hpp"
#include "loop_setup.hpp"

namespace jackal_aic::sim {

/// A step from rest and the stop after it.
struct StopCase {
  std::string controller;
  std::string plant;          ///< box or ground
  double limit_factor = 1.0;  ///< acceleration limit of the robot / of the model
  SetPoint set_point;         ///< from kRestTime until the stop
};

/// Figures of a StopCase, each of the larger of its channels: forward speed and yaw rate, where the set point has them.
struct StopFigures {
  double overshoot_pct = 0.0;      ///< largest excursion beyond the set point until the stop, of the set point
  double without_limit_pct = 0.0;  ///< of a turn on the ground: the same on a robot whose motors have no limit, which
                                   ///< is what the effective track makes of it; else 0
  std::optional<double> settling;  ///< time from which both stay within 5 % of the set point until the stop [s]
  double beyond_mps = 0.0;         ///< largest forward speed beyond zero after the stop [m/s]
  double beyond_radps = 0.0;       ///< largest yaw rate beyond zero after the stop [rad/s]
};

/// What the figures of a case must keep.
struct StopBars {
  double overshoot_pct;
  double beyond_mps;
  double beyond_radps;
};

/// Bars of a case by its preset and the limit of its robot.
StopBars barsOf(const StopCase& stop_case);

/// True if the figures keep the bars. What a robot without limit does in a turn on the ground is no wind-up: the
/// effective track of a skid-steer robot depends on its motion.
bool keeps(const StopFigures& figures, const StopBars& bars);

/// Every preset of an active inference controller at 0.1..2 m/s, 0.5..2 rad/s and arcs of both, on ground and box, with
/// robots of half the model's acceleration limit, the model's and twice that.
std::vector<StopCase> stopCases();

/// Runs a case with the limits of the drive command that the robot has (config/jackal.yaml). @param overrides further
/// settings, e.g. of the plant.
StopFigures runCase(const PackageFiles& files, const StopCase& stop_case, const Overrides& overrides = {});

/// The case in words, e.g. for a message.
std::string nameOf(const StopCase& stop_case);

/// Runs every case and writes stops.csv into a directory; returns how many do not keep their bars. @param jobs threads;
/// 0: one per core.
std::size_t writeStopTable(const PackageFiles& files, const std::string& directory, const Overrides& overrides,
                           unsigned jobs);

}  // namespace jackal_aic::sim
