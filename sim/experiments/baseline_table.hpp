#pragma once

/// @file
/// The predictive controller beside published ones of a plant with dead time, at equal robustness.
///
/// "Should we forget the Smith predictor?" ask Grimholt and Skogestad (2018): a controller with a predictor has to be
/// compared with a well-tuned PID controller of the same robustness. So every structure is tuned by the same search for
/// the least error after a disturbance, under the same margins and a largest peak of the sensitivity, Ms.

#include <string>
#include <vector>

#include "baselines.hpp"
#include "jackal_aic/certificate/certificate.hpp"
#include "loop_figures.hpp"
#include "loop_setup.hpp"

namespace jackal_aic::sim {

/// What a tuning has to keep.
struct RobustnessBounds {
  double peak_sensitivity = 1.6;       ///< Ms
  MarginBounds margins = {2.0, 0.05};  ///< gain and delay
};

/// The controllers that are compared: controlBaselines() and, behind them, `predictive` with its process noises and
/// its learning rate of the action tuned, and `predictive_preset` as config/predictive.yaml has it, with nothing tuned.
/// @param preset of it.
std::vector<Baseline> comparedStructures(const PredictiveParameters& preset);

/// A structure with what was found for it.
struct TunedBaseline {
  std::vector<double> values;  ///< of what is tuned
  LoopFigures figures;         ///< on the robot that is its model
};

/// True if the figures keep the bounds.
bool keeps(const LoopFigures& figures, const RobustnessBounds& bounds);

/// The values with the least IAE within the bounds that local searches find, one from the structure's own start and one
/// from `start`; where they find none within them, those nearest to them.
TunedBaseline tune(const Baseline& structure, const PlantModel& model, const GeometryParameters& geometry,
                   const RobustnessBounds& bounds, const std::vector<double>& start);

/// Tunes every structure on box and ground for Ms of 1.3 to 2, looks at each with half and one and a half times the
/// dead time, and drives those of Ms 1.6 through the drive loop on the simulated robot with its acceleration limit.
/// Writes baselines.csv and baselines_driven.csv into a directory. @param jobs threads; 0: one per core.
void writeBaselineTables(const PackageFiles& files, const std::string& directory, unsigned jobs);

}  // namespace jackal_aic::sim
