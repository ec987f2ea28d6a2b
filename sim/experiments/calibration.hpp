#pragma once

/// @file
/// Fit of the plant to the settling and rise times of the thesis.

#include <functional>
#include <string>
#include <vector>

#include "experiment_table.hpp"

namespace jackal_aic::sim {

/// A parameter to be fitted, in the logarithm of its range.
struct FitParameter {
  const char* name;                 ///< key without the prefix
  double PlantParameters::*member;  ///< where it is kept
  double low;                       ///< lower bound
  double high;                      ///< upper bound
  double resolution = 0.0;          ///< values are multiples of this; 0: three significant digits
};

/// One fit: which plant, to which tables, by which parameters.
struct CalibrationTask {
  std::string plant;                  ///< a name of plantNames(): everything that is not fitted comes from it
  std::string file;                   ///< file of config/ that keeps it
  std::vector<std::string> fitted;    ///< tables whose rows the fit minimises over
  std::vector<std::string> held_out;  ///< tables that are only reported
  std::vector<FitParameter> parameters;
};

/// The two fits: the box to chapter 5, the ground to Tables 3-1.
const std::vector<CalibrationTask>& calibrationTasks();

/// One row of a table with our result on a plant.
struct Residual {
  ThesisStep thesis;
  Integrator integrator;           ///< used for the comparison; without meaning for the differential drive
  std::optional<double> settling;  ///< ours [s]
  std::optional<double> rise;      ///< ours [s]

  /// |ln(ours/thesis)| of settling and rise time; kMissing where ours does not exist, nothing where the thesis prints
  /// none.
  std::vector<double> errors() const;
};

/// |ln(ours/thesis)| of a response that never settles or rises.
inline constexpr double kMissing = 2.0;

/// Runs all rows of some tables on a plant without noise.
std::vector<Residual> residuals(const PackageFiles& files, const std::vector<std::string>& tables,
                                const PlantParameters& plant, unsigned jobs);

/// Mean of errors() over all rows. @throws ParameterError if there is none.
double meanError(const std::vector<Residual>& residuals);

/// Result of a fit.
struct Calibration {
  PlantParameters plant;  ///< the plant of the task with the fitted parameters
  double error;           ///< mean |ln(ours/thesis)| over the fitted tables
};

/// Fits a plant: a global search (DIRECT-L) over the ranges, then a local one (Subplex) from the best point so far, the
/// first of which is the plant as it is: a fit is never worse than the one before. Deterministic.
///
/// What is minimised is the mean of meanError() over the dead time and the dead time 2 ms shorter and longer: the
/// settling time is a function with jumps (whether an undershoot of 5 % counts), so that the least error of a single
/// plant may sit on an edge that no measurement would tell.
/// @param evaluations largest number of evaluations of each of the two searches; @param jobs threads (0: one per core);
/// @param progress called with the number of evaluations so far and the best error.
Calibration calibrate(const PackageFiles& files, const CalibrationTask& task, int evaluations, unsigned jobs,
                      const std::function<void(int, double)>& progress = {});

/// A plant file with the fitted values put in; everything else, comments too, stays as it is.
/// @param yaml text of the plant file. @throws ParameterError if it lacks the line of a fitted parameter.
std::string withFittedValues(std::string yaml, const CalibrationTask& task, const PlantParameters& plant);

}  // namespace jackal_aic::sim
