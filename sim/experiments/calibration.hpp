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
  std::string plant;                ///< a name of plantNames(): everything that is not fitted comes from it
  std::string file;                 ///< file of config/ that keeps it
  std::vector<std::string> tables;  ///< tables of the thesis whose rows the fit minimises over
  std::vector<std::string> trends;  ///< those of them whose trends it minimises over as well
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

/// What the thesis found that ours does not show: the mean, over the pairs of neighbouring rows, of how much less than
/// in the thesis our settling time falls from the slower to the faster of the two, max(0, ln(thesis_slow/thesis_fast) -
/// ln(ours_slow/ours_fast)). Neighbours are of the same table and column or, where the column has no other row, line. 0
/// if there is no such pair.
double trendError(const std::vector<Residual>& residuals);

/// Result of a fit.
struct Calibration {
  PlantParameters plant;  ///< the plant of the task with the fitted parameters
  double error = 0.0;     ///< meanError() over the tables of the task
};

/// Fits a plant: a global search (DIRECT-L) over the ranges, then a local one (Subplex) from the best point so far, the
/// first of which is the plant as it is: a fit is never worse than the one before. Deterministic.
///
/// What is minimised is meanError() + trendError(): the thesis' result is that settling falls with its parameters,
/// more than what it is. A settling time is a function with jumps (whether an undershoot of 5 % counts), so that the
/// least error of a single plant may sit on an edge that no measurement would tell. So it is the mean of that sum over
/// the dead time and the dead time 2 ms shorter and longer, each with settling bands of 4, 5 and 6 %.
/// @param evaluations largest number of evaluations of each of the two searches; @param jobs threads (0: one per core);
/// @param progress called with the number of evaluations so far and the best error.
Calibration calibrate(const PackageFiles& files, const CalibrationTask& task, int evaluations, unsigned jobs,
                      const std::function<void(int, double)>& progress = {});

/// What a fit says of a table that it has not seen: meanError() of the table on the plant fitted to the others of the
/// task.
/// @param start plant from which the local search sets out, e.g. that of the fit to all; the rest as calibrate().
double leaveOneOutError(const PackageFiles& files, CalibrationTask task, const std::string& table,
                        const PlantParameters& start, int evaluations, unsigned jobs);

/// A plant file with the fitted values put in; everything else, comments too, stays as it is.
/// @param yaml text of the plant file. @throws ParameterError if it lacks the line of a fitted parameter.
std::string withFittedValues(std::string yaml, const CalibrationTask& task, const PlantParameters& plant);

}  // namespace jackal_aic::sim
