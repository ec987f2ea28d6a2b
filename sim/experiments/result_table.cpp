#include "result_table.hpp"

#include <fmt/format.h>

#include <cmath>

#include "csv.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kTraceStep = 0.01;  // s

std::string number(double value) {
  if (!std::isfinite(value)) return "nan";
  if (value == 0.0) value = 0.0;  // no "-0"
  return fmt::format("{:.6g}", value);
}

std::string number(const std::optional<double>& value) { return value ? number(*value) : ""; }

/// A column of the results.
struct Column {
  const char* name;
  std::string (*cell)(const ResultRow& row);
};

const Column kColumns[] = {
    {"experiment", [](const ResultRow& row) { return csvField(row.experiment); }},
    {"controller", [](const ResultRow& row) { return csvField(row.controller); }},
    {"plant", [](const ResultRow& row) { return csvField(row.plant); }},
    {"step_mps", [](const ResultRow& row) { return number(row.step_mps); }},
    {"step_radps", [](const ResultRow& row) { return number(row.step_radps); }},
    {"belief_hz", [](const ResultRow& row) { return number(row.belief_hz); }},
    {"action_hz", [](const ResultRow& row) { return number(row.action_hz); }},
    {"integrator", [](const ResultRow& row) { return row.integrator; }},
    {"tau", [](const ResultRow& row) { return number(row.tau); }},
    {"kappa_mu", [](const ResultRow& row) { return number(row.kappa_mu); }},
    {"kappa_a", [](const ResultRow& row) { return number(row.kappa_a); }},
    {"orders", [](const ResultRow& row) { return number(row.orders); }},
    {"settling_s", [](const ResultRow& row) { return number(row.settling_s); }},
    {"rise_s", [](const ResultRow& row) { return number(row.rise_s); }},
    {"overshoot_pct", [](const ResultRow& row) { return number(row.overshoot_pct); }},
    {"steady_error_pct", [](const ResultRow& row) { return number(row.steady_error_pct); }},
    {"bounded", [](const ResultRow& row) { return std::string(row.bounded ? "1" : "0"); }},
    {"thesis_settling_s", [](const ResultRow& row) { return number(row.thesis_settling_s); }},
    {"thesis_rise_s", [](const ResultRow& row) { return number(row.thesis_rise_s); }},
    {"label", [](const ResultRow& row) { return csvField(row.label); }},
    {"tracking_rms_mps", [](const ResultRow& row) { return number(row.tracking_rms_mps); }},
    {"tracking_rms_radps", [](const ResultRow& row) { return number(row.tracking_rms_radps); }},
    {"belief_rms_mps", [](const ResultRow& row) { return number(row.belief_rms_mps); }},
    {"belief_rms_radps", [](const ResultRow& row) { return number(row.belief_rms_radps); }},
    {"belief_bias_pct", [](const ResultRow& row) { return number(row.belief_bias_pct); }},
    {"effective_track", [](const ResultRow& row) { return number(row.effective_track); }},
};

}  // namespace

void describeController(const ControllerParameters& parameters, ResultRow& row) {
  row.belief_hz = parameters.belief_rate;
  row.action_hz = parameters.action_rate;
  row.integrator = kIntegratorNames[static_cast<std::size_t>(parameters.integrator)];
  row.tau = parameters.tau;
  row.kappa_mu = parameters.kappa_mu;
  row.kappa_a = parameters.kappa_a;
  row.orders = parameters.orders;
}

void describeStep(const SetPointProfile& profile, ResultRow& row) {
  if (!profile.assessed) return;
  const SetPoint before = profile.at(profile.assessed_from - JackalPlant::kStep);
  const SetPoint after = profile.at(profile.assessed_from);
  row.step_mps = after.forward - before.forward;
  row.step_radps = after.yaw_rate - before.yaw_rate;
}

void describeResponse(const ResponseMetrics& metrics, ResultRow& row) {
  row.bounded = metrics.bounded;
  if (!metrics.bounded) return;
  row.settling_s = metrics.settling;
  row.rise_s = metrics.rise;
  row.overshoot_pct = metrics.overshoot_pct;
  row.steady_error_pct = metrics.steady_error_pct;
}

void describeErrors(const std::vector<Sample>& samples, const SetPointProfile& profile, ResultRow& row) {
  const RunErrors errors = runErrors(samples);
  row.tracking_rms_mps = errors.tracking(kForward);
  row.tracking_rms_radps = errors.tracking(kYaw);
  if (!errors.belief) return;
  row.belief_rms_mps = (*errors.belief)(kForward);
  row.belief_rms_radps = (*errors.belief)(kYaw);
  row.belief_bias_pct = beliefBias(samples, profile);
}

RunResult runSetup(const LoopSetup& setup, const SetPointProfile& profile) {
  JackalPlant plant(setup.urdf, setup.plant);
  DriveLoop drive = makeLoop(setup);
  RunResult result;
  result.samples = runClosedLoop(plant, drive, profile, setup.plant.support, setup.drive.geometry, setup.loop);
  result.row.controller = setup.controller_name;
  result.row.plant = setup.plant_name;
  if (const auto* thesis = std::get_if<ControllerParameters>(&setup.drive.controller)) {
    describeController(*thesis, result.row);
  } else if (const auto* predictive = std::get_if<PredictiveParameters>(&setup.drive.controller)) {
    result.row.belief_hz = predictive->belief_rate;
    result.row.action_hz = predictive->action_rate;
    result.row.integrator = kIntegratorNames[static_cast<std::size_t>(Integrator::exact)];
    result.row.kappa_mu = predictive->belief_learning_rate;
    result.row.kappa_a = predictive->action_learning_rate;
  } else {
    result.row.action_hz = std::get<DifferentialDriveParameters>(setup.drive.controller).rate;
  }
  if (const PredictiveController* predictive = drive.predictive()) {
    result.row.effective_track = predictive->effectiveTrack();
  }
  describeStep(profile, result.row);
  const ResponseMetrics metrics = assess(result.samples, profile);
  if (profile.assessed) {
    describeResponse(metrics, result.row);
  } else {
    result.row.bounded = metrics.bounded;
  }
  return result;
}

std::string resultHeader() {
  std::vector<const char*> names;
  for (const Column& column : kColumns) names.push_back(column.name);
  return fmt::format("{}\n", fmt::join(names, ","));
}

std::string resultLine(const ResultRow& row) {
  std::vector<std::string> cells;
  for (const Column& column : kColumns) cells.push_back(column.cell(row));
  return fmt::format("{}\n", fmt::join(cells, ","));
}

std::string resultText(const ResultRow& row) {
  std::string text;
  for (const Column& column : kColumns) {
    const std::string cell = column.cell(row);
    if (!cell.empty()) text += fmt::format("{:<20}{}\n", column.name, cell);
  }
  return text;
}

std::string traceHeader() {
  return "run,label,time_s,set_point_mps,velocity_mps,measured_mps,belief_mps,set_point_radps,yaw_rate_radps,"
         "measured_radps,belief_radps,command_left_radps,command_right_radps\n";
}

std::string traceLines(std::size_t run, const RunResult& result) {
  std::string lines;
  double due = 0.0;
  for (const Sample& s : result.samples) {
    if (s.time < due - 0.5 * JackalPlant::kStep) continue;
    due = s.time + kTraceStep;
    const auto belief = [&](BodyChannel which) { return s.belief ? number((*s.belief)(which)) : std::string(); };
    const std::vector<std::string> cells{
        std::to_string(run),    csvField(result.row.label),  number(s.time),   number(s.set_point.forward),
        number(s.velocity),     number(s.measured_velocity), belief(kForward), number(s.set_point.yaw_rate),
        number(s.yaw_rate),     number(s.measured_yaw_rate), belief(kYaw),     number(s.command.left),
        number(s.command.right)};
    lines += fmt::format("{}\n", fmt::join(cells, ","));
  }
  return lines;
}

}  // namespace jackal_aic::sim
