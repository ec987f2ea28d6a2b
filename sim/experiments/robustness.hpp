#pragma once

/// @file
/// One step response on each of many robots that are drawn over everything in which a real one differs from its model.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "perturbation.hpp"

namespace jackal_aic::sim {

/// Bars of a drawn robot.
struct RobustnessBars {
  double settling_factor;  ///< of open loop's settling time on the same robot
  double settling_margin;  ///< beside [s]
  double steady_error;     ///< [% of the step]
  double belief_error;     ///< [% of the step]
};

/// Those of the package (acceptance.yaml).
RobustnessBars robustnessBars(const PackageFiles& files);

/// What a controller does on a drawn robot.
struct RobustnessRun {
  bool bounded = false;
  std::optional<double> settling;    ///< [s]; empty if it does not settle
  std::optional<double> open_loop;   ///< settling of the open loop, which has the stock controller's limits [s]
  double steady_error_pct = 0.0;     ///< mean true speed of the last 0.5 s against the set point
  std::optional<double> belief_pct;  ///< mean believed minus true speed there; empty without a belief

  /// Whether it settles as soon as its bar asks; where the open loop does not, nothing is asked.
  bool settles(const RobustnessBars& bars) const;
};

/// A step to 0.5 m/s by a controller and by the open loop on the robot that drawReality() draws from a seed. The
/// controller knows the mean radius of the tyres, as one who measured it would tell it, and of everything else what
/// plant_real.yaml has for the drive train. @param controller a preset, or a file.
RobustnessRun runRobustness(const PackageFiles& files, const std::string& controller, std::uint64_t seed);

/// How many of the runs keep their bars.
struct RobustnessSummary {
  std::size_t runs = 0;
  std::size_t unstable = 0;
  std::size_t settled = 0;   ///< as soon as asked
  std::size_t exact = 0;     ///< with the steady-state error asked
  std::size_t believed = 0;  ///< with the belief asked; all, if there is no belief
};

/// Counts.
RobustnessSummary summarise(const std::vector<RobustnessRun>& runs, const RobustnessBars& bars);

/// Overshoot of a controller in the turn that drawSoftMotorTurn() draws from a seed [%]; empty if it is unstable.
std::optional<double> turnOvershoot(const PackageFiles& files, const std::string& controller, std::uint64_t seed);

/// Runs every preset on robots drawn from seed, seed + 1, ...; writes robustness.csv, and soft_motors.csv of the turns
/// with soft motors, into a directory and prints a line per preset and table. @param jobs threads; 0: one per core.
/// @throws ParameterError if draws is 0 or a file cannot be written.
void writeRobustnessTable(const PackageFiles& files, std::size_t draws, std::uint64_t seed,
                          const std::string& directory, unsigned jobs);

}  // namespace jackal_aic::sim
