#include "usable_range.hpp"

#include <fmt/format.h>

#include <cmath>

namespace jackal_aic::sim {
namespace {

constexpr double kStride = 1.189207115002721;  // 2^(1/4)
constexpr double kPrecision = 0.005;
constexpr double kStep = 0.5;      // m/s
constexpr double kDuration = 4.0;  // s

Overrides with(const ThesisLimit& limit, Integrator integrator, double value) {
  Overrides overrides = limit.overrides;
  overrides.emplace_back("controller.integrator", kIntegratorNames[static_cast<std::size_t>(integrator)]);
  overrides.emplace_back("controller." + limit.parameter, fmt::format("{}", value));
  return overrides;
}

double bound(const ThesisLimit& limit) { return limit.is_minimum ? 1e-5 : 1e3; }

double startValue(const PackageFiles& files, const ThesisLimit& limit) {
  const ControllerParameters p = loadThesis(files, limit.controller, limit.overrides).controller;
  if (limit.parameter == "tau") return p.tau;
  if (limit.parameter == "kappa_mu") return p.kappa_mu;
  if (limit.parameter == "kappa_a") return p.kappa_a;
  throw ParameterError("parameter = '" + limit.parameter + "': expected tau, kappa_mu or kappa_a");
}

RunResult respond(const PackageFiles& files, const ThesisLimit& limit, Integrator integrator, double value) {
  const LoopSetup setup = loadPrintedSetup(files, limit.controller, limit.plant, with(limit, integrator, value));
  return runSetup(setup, stepProfile(kStep, 0.0, kDuration));
}

RunResult searchOnPlant(const PackageFiles& files, const ThesisLimit& limit, Integrator integrator) {
  const double start = startValue(files, limit);
  const double longest =
      limit.parameter == "kappa_a" ? respond(files, limit, integrator, start).row.settling_s.value_or(0.0) : kDuration;
  const RangeLimit found = searchLimit(start, bound(limit), [&](double value) {
    const ResultRow row = respond(files, limit, integrator, value).row;
    return row.stable && row.settling_s && *row.settling_s <= longest;
  });
  RunResult result = respond(files, limit, integrator, found.value);
  result.samples.clear();
  return result;
}

RunResult searchBelief(const PackageFiles& files, const ThesisLimit& limit, Integrator integrator) {
  const RangeLimit found = searchLimit(startValue(files, limit), bound(limit), [&](double value) {
    return beliefConverges(loadThesis(files, limit.controller, with(limit, integrator, value)), integrator);
  });
  RunResult result;
  result.row.controller = limit.controller;
  describeController(loadThesis(files, limit.controller, with(limit, integrator, found.value)).controller, result.row);
  return result;
}

}  // namespace

RangeLimit searchLimit(double start, double bound, const std::function<bool(double)>& usable) {
  const double stride = bound > start ? kStride : 1.0 / kStride;
  const auto beyond = [&](double value) { return bound > start ? value >= bound : value <= bound; };
  double good = start;
  double bad = start * stride;
  while (!beyond(bad) && usable(bad)) {
    good = bad;
    bad *= stride;
  }
  if (beyond(bad)) {
    if (usable(bound)) return {bound, true};
    bad = bound;
  }
  while (std::abs(bad / good - 1.0) > kPrecision) {
    const double middle = std::sqrt(good * bad);
    (usable(middle) ? good : bad) = middle;
  }
  return {good, false};
}

std::vector<Run> usableRangeRuns(const PackageFiles& files, const ThesisLimit& limit, Integrator integrator) {
  std::vector<Run> runs;
  runs.emplace_back([&files, limit, integrator] { return searchOnPlant(files, limit, integrator); });
  if (limit.parameter == "kappa_a") return runs;
  runs.emplace_back([&files, limit, integrator] { return searchBelief(files, limit, integrator); });
  return runs;
}

}  // namespace jackal_aic::sim
