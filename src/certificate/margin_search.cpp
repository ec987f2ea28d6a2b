#include "margin_search.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "jackal_aic/certificate/boundary.hpp"

namespace jackal_aic {
namespace {

constexpr double kSmallestGainFactor = 1e-3;
constexpr double kStep = 0.01;  // of a parameter, relative, for its sensitivity

/// Factor on the gain at which the verdict changes on the way from 1 to `end`; `none` if it does not.
double gainBoundary(const LoopTest& stable, double end, double none) {
  const double ratio = end > 1.0 ? 1.1 : 1.0 / 1.1;
  const auto boundary = findBoundary(
      [&](double factor) {
        return stable({factor, 0.0});
      },
      1.0, end, [&](double factor) { return ratio * factor; });
  return boundary ? boundary->before : none;
}

/// d ln(rho) / d ln(parameter); 0 if it is not finite.
double sensitivityTo(const LoopParameter& parameter, double SpectralRadii::*radius) {
  const auto log_radius = [&](double factor) { return std::log(parameter.radii(factor * parameter.value).*radius); };
  const double above = parameter.value * (1.0 + kStep) > parameter.largest ? 1.0 : 1.0 + kStep;
  const double slope = (log_radius(above) - log_radius(1.0 - kStep)) / std::log(above / (1.0 - kStep));
  return std::isfinite(slope) ? slope : 0.0;
}

/// In the order in which they are to be asked.
std::vector<LoopParameter> suspects(const std::vector<LoopParameter>& parameters) {
  std::vector<LoopParameter> list;
  const auto take = [&](const auto& is_suspect) {
    std::copy_if(parameters.begin(), parameters.end(), std::back_inserter(list),
                 [&](const LoopParameter& p) { return p.fallback && is_suspect(p); });
  };
  take([](const LoopParameter& p) { return p.changed; });
  // Of several changes, those first without which the loop is stable.
  if (list.size() > 1) {
    std::stable_partition(list.begin(), list.end(),
                          [](const LoopParameter& p) { return p.radii(*p.fallback).stable(); });
  }
  if (!list.empty()) return list;
  take([](const LoopParameter& p) { return p.value == 0.0; });
  for (const Sensitivity& sensitivity : sensitivitiesTo(parameters)) {
    take([&](const LoopParameter& p) { return p.name == sensitivity.parameter; });
  }
  return list;
}

Culprit examine(const LoopParameter& suspect) {
  Culprit culprit{suspect.name, suspect.value};
  if (suspect.range) culprit.range = suspect.range();
  if (suspect.radii(*suspect.fallback).stable()) culprit.stable_with = suspect.fallback;
  return culprit;
}

}  // namespace

double delayBoundary(const LoopTest& stable, double action_period, double end) {
  if (end == 0.0) return 0.0;
  const double stride = std::copysign(0.25 * action_period, end);
  const auto boundary = findBoundary(
      [&](double extra) {
        return stable({1.0, extra});
      },
      0.0, end, [&](double extra) { return 1.1 * extra + stride; });
  return boundary ? boundary->before : end;
}

Margins findMargins(const LoopTest& stable, double action_period, double dead_time) {
  const bool is_stable = stable({});
  Margins margins;
  margins.gain_reduction = gainBoundary(stable, kSmallestGainFactor, 0.0);
  margins.gain_margin =
      is_stable ? gainBoundary(stable, kLargestGainMargin, kLargestGainMargin) : margins.gain_reduction;
  margins.delay_margin =
      delayBoundary(stable, action_period, is_stable ? largestDelayMargin(action_period) : -dead_time);
  return margins;
}

ThinMargin thinMarginOf(const LoopTest& stable, const MarginBounds& bounds) {
  if (!stable({bounds.gain, 0.0})) return ThinMargin::gain;
  return stable({1.0, bounds.delay}) ? ThinMargin::none : ThinMargin::delay;
}

std::vector<Sensitivity> sensitivitiesTo(const std::vector<LoopParameter>& parameters) {
  const LoopParameter& any = parameters.front();
  const bool belief = any.radii(any.value).belief_spectral_radius >= kStabilityLimit;
  const auto radius = belief ? &SpectralRadii::belief_spectral_radius : &SpectralRadii::loop_spectral_radius;
  std::vector<Sensitivity> list;
  for (const LoopParameter& parameter : parameters) {
    const double value = sensitivityTo(parameter, radius);
    if (value != 0.0) list.push_back({parameter.name, value});
  }
  std::stable_sort(list.begin(), list.end(),
                   [](const auto& a, const auto& b) { return std::abs(a.value) > std::abs(b.value); });
  return list;
}

std::optional<Culprit> findCulprit(const std::vector<LoopParameter>& parameters) {
  std::optional<Culprit> first;
  for (const LoopParameter& suspect : suspects(parameters)) {
    const Culprit culprit = examine(suspect);
    if (culprit.range || culprit.stable_with) return culprit;
    if (!first) first = culprit;
  }
  return first;
}

}  // namespace jackal_aic
