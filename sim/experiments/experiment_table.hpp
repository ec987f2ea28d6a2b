#pragma once

/// @file
/// The table of experiments (experiments.yaml) and the runs each of them consists of.

#include <functional>
#include <string>
#include <vector>

#include "package_files.hpp"
#include "result_table.hpp"
#include "thesis_tables.hpp"

namespace jackal_aic::sim {

/// One run of an experiment: gives one row of its result table and, unless it is a search, a trace. Runs are
/// independent, and hold all that they need.
using Run = std::function<RunResult()>;

/// An experiment as it is listed.
struct ExperimentSummary {
  std::string name;
  std::string title;
  std::vector<std::string> figures;  ///< figures of the thesis drawn from it
};

/// The experiments. Every function throws ParameterError if the data files do not fit together.
class ExperimentTable {
 public:
  /// @param files must outlive the table, not its runs.
  explicit ExperimentTable(const PackageFiles& files);

  /// All experiments, in order.
  std::vector<ExperimentSummary> list() const;

  /// Runs of an experiment, in the order of its rows. @throws ParameterError for an unknown name, with the list of
  /// names.
  std::vector<Run> runs(const std::string& name) const;

 private:
  const PackageFiles& files_;
  std::string path_;
};

/// The closed loop of one row of a step response table of the thesis. @param integrator for an active inference
/// controller.
LoopSetup thesisSetup(const PackageFiles& files, const ThesisStep& step, Integrator integrator);

/// Set point of a row: its step from rest.
SetPointProfile thesisProfile(const ThesisStep& step);

/// Runs the step of such a row on a loop. @param setup as thesisSetup() gives it, or on another plant.
RunResult runThesisStep(const LoopSetup& setup, const ThesisStep& step);

/// The same on the row's own loop.
RunResult runThesisStep(const PackageFiles& files, const ThesisStep& step, Integrator integrator);

/// Integrator with which a row is compared with the thesis: the thesis' own euler where its belief update converges,
/// else exact. The differential drive has none; the result is then without meaning.
Integrator comparableIntegrator(const PackageFiles& files, const ThesisStep& step);

/// True if one step of the belief update alone, by this integrator, has a spectral radius below 1.
bool beliefConverges(ThesisSetup setup, Integrator integrator);

}  // namespace jackal_aic::sim
