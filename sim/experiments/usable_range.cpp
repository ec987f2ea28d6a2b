#include "usable_range.hpp"

#include "jackal_aic/certificate/boundary.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kStride = 1.189207115002721;  // 2^(1/4)
constexpr double kPrecision = 0.005;
constexpr double kStep = 0.5;  // m/s

using Gain = double ControllerParameters::*;

double bound(const ThesisLimit& limit) { return limit.is_minimum ? 1e-5 : 1e3; }

Gain gainOf(const ThesisLimit& limit) {
  if (limit.parameter == "tau") return &ControllerParameters::tau;
  if (limit.parameter == "kappa_mu") return &ControllerParameters::kappa_mu;
  if (limit.parameter == "kappa_a") return &ControllerParameters::kappa_a;
  throw ParameterError("parameter = '" + limit.parameter + "': expected tau, kappa_mu or kappa_a");
}

RunResult respond(LoopSetup setup, Gain gain, double value) {
  std::get<ControllerParameters>(setup.drive.controller).*gain = value;
  return runSetup(setup, stepProfile(kStep, 0.0, kStepDuration));
}

/// @param start usable value of the gain.
RunResult searchOnPlant(const LoopSetup& setup, Gain gain, double start, double bound) {
  const double longest =
      gain == &ControllerParameters::kappa_a ? respond(setup, gain, start).row.settling_s.value_or(0.0) : kStepDuration;
  const RangeLimit found = searchLimit(start, bound, [&](double value) {
    const ResultRow row = respond(setup, gain, value).row;
    return row.bounded && row.settling_s && *row.settling_s <= longest;
  });
  RunResult result = respond(setup, gain, found.value);
  result.samples.clear();
  return result;
}

/// As searchOnPlant(), of the belief update alone. @param controller its name.
RunResult searchBelief(const std::string& controller, ThesisSetup setup, Gain gain, double bound) {
  const RangeLimit found = searchLimit(setup.controller.*gain, bound, [&](double value) {
    setup.controller.*gain = value;
    return beliefConverges(setup, setup.controller.integrator);
  });
  setup.controller.*gain = found.value;
  RunResult result;
  result.row.controller = controller;
  describeController(setup.controller, result.row);
  return result;
}

}  // namespace

RangeLimit searchLimit(double start, double bound, const std::function<bool(double)>& usable) {
  const double stride = bound > start ? kStride : 1.0 / kStride;
  const auto limit = findBoundary([&](double value) { return value == start || usable(value); }, start, bound,
                                  [&](double value) { return stride * value; }, kPrecision);
  return limit ? RangeLimit{limit->before, false} : RangeLimit{bound, true};
}

std::vector<Run> usableRangeRuns(const PackageFiles& files, const ThesisLimit& limit, Integrator integrator) {
  const Gain gain = gainOf(limit);
  const double end = bound(limit);
  ThesisSetup belief = loadThesis(files, limit.controller, limit.overrides);
  belief.controller.integrator = integrator;
  LoopSetup loop = loadPrintedSetup(files, limit.controller, limit.plant, limit.overrides);
  std::get<ControllerParameters>(loop.drive.controller).integrator = integrator;
  std::vector<Run> runs;
  runs.emplace_back([=, start = belief.controller.*gain] { return searchOnPlant(loop, gain, start, end); });
  if (gain == &ControllerParameters::kappa_a) return runs;
  runs.emplace_back([=, name = limit.controller] { return searchBelief(name, belief, gain, end); });
  return runs;
}

}  // namespace jackal_aic::sim
