#pragma once

/// @file
/// Results of closed loops as rows of CSV files.

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "closed_loop.hpp"
#include "loop_setup.hpp"

namespace jackal_aic::sim {

/// One row of the result tables; an empty field prints as nothing.
struct ResultRow {
  std::string experiment;
  std::string controller;
  std::string plant;                 ///< box, ground, a file, or state_space for the model of chapter 4
  std::optional<double> step_mps;    ///< height of the assessed step of the forward speed [m/s]
  std::optional<double> step_radps;  ///< height of the assessed step of the yaw rate [rad/s]
  std::optional<double> belief_hz;
  std::optional<double> action_hz;
  std::string integrator;
  std::optional<double> tau;
  std::optional<double> kappa_mu;
  std::optional<double> kappa_a;
  std::optional<double> orders;
  std::optional<double> settling_s;
  std::optional<double> rise_s;
  std::optional<double> overshoot_pct;
  std::optional<double> steady_error_pct;
  bool bounded = true;
  std::optional<double> thesis_settling_s;
  std::optional<double> thesis_rise_s;
  std::string label;                         ///< tells runs apart that differ in what the row does not show
  std::optional<double> tracking_rms_mps;    ///< true forward speed against its set point [m/s]
  std::optional<double> tracking_rms_radps;  ///< true yaw rate against its set point [rad/s]
  std::optional<double> belief_rms_mps;      ///< believed against true forward speed [m/s]
  std::optional<double> belief_rms_radps;    ///< believed against true yaw rate [rad/s]
  std::optional<double> belief_bias_pct;     ///< mean error of the belief at the end [% of the set point]
  std::optional<double> effective_track;     ///< believed b_hat at the end [m]
};

/// The result of one run: its row and the samples behind it.
struct RunResult {
  ResultRow row;
  std::vector<Sample> samples;
};

/// Fills the columns that describe a controller.
void describeController(const ControllerParameters& parameters, ResultRow& row);

/// Fills the columns that describe the assessed step of a profile.
void describeStep(const SetPointProfile& profile, ResultRow& row);

/// Fills the columns of the figures; an unstable response has none.
void describeResponse(const ResponseMetrics& metrics, ResultRow& row);

/// Fills the columns of the errors over the run.
void describeErrors(const std::vector<Sample>& samples, const SetPointProfile& profile, ResultRow& row);

/// Builds the loop of a setup, runs it along a profile and assesses it.
RunResult runSetup(const LoopSetup& setup, const SetPointProfile& profile);

/// Header line of the result tables.
std::string resultHeader();

/// One line of the result tables.
std::string resultLine(const ResultRow& row);

/// A row for a person: a line with name and value for each column that has one.
std::string resultText(const ResultRow& row);

/// Header line of the traces: run is the index of the row in the result table, from 0.
std::string traceHeader();

/// Lines of the trace of one run, at most every 10 ms. Numbers that are not finite print as nan.
std::string traceLines(std::size_t run, const RunResult& result);

}  // namespace jackal_aic::sim
