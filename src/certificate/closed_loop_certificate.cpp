#include "jackal_aic/certificate/closed_loop_certificate.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "jackal_aic/certificate/boundary.hpp"
#include "margin_search.hpp"

namespace jackal_aic {
namespace {

constexpr int kPointsPerDecade = 16;
constexpr double kSmallestGain = 1e-9;  // where a scan begins if a gain may be zero

ModeCertificate certifyMode(const LinearLoop& loop, LoopMode mode) {
  const double radius = loop.worstSpectralRadius(mode);
  const SearchedLoop searched{radius < kStabilityLimit,
                              [&](const LoopChange& change) { return loop.stable(mode, change); },
                              [&](const LoopChange& change) { return loop.periodMap(mode, change); },
                              loop.singleRate() && loop.plant().lag > 0.0,
                              loop.period(),
                              loop.longestPhase(),
                              loop.controller().actionStep(),
                              loop.plant().dead_time};
  return {findMargins(searched), radius};
}

/// The margins that are closer to the limit.
Margins smaller(const Margins& a, const Margins& b) {
  return {std::min(a.gain_margin, b.gain_margin), std::max(a.gain_reduction, b.gain_reduction),
          std::min(a.delay_margin, b.delay_margin)};
}

SpectralRadii radiiOf(const LinearLoop& loop) { return {loop.beliefSpectralRadius(), loop.worstSpectralRadius()}; }

/// All variances of a kind by one factor.
ControllerParameters scaled(ControllerParameters controller, std::vector<double> ControllerParameters::*variances,
                            double factor) {
  for (double& variance : controller.*variances) variance *= factor;
  return controller;
}

/// The value itself if the verdict holds there, else the nearest one above or below by ratio.
std::optional<double> nearestHolding(const LineTest& holds, double value, double low, double high,
                                     const std::function<double(double)>& up,
                                     const std::function<double(double)>& down) {
  if (holds(value)) return value;
  const auto above = findBoundary(holds, value, high, up);
  const auto below = findBoundary(holds, value, low, down);
  if (above && below) return above->after / value < value / below->after ? above->after : below->after;
  if (above) return above->after;
  if (below) return below->after;
  return std::nullopt;
}

LoopParameter gainParameter(const ControllerParameters& controller, const GeometryParameters& geometry,
                            const PlantModel& plant, Gain gain) {
  ControllerParameters present = controller;
  const auto with = [=](double value) {
    ControllerParameters changed = controller;
    gainOf(changed, gain) = value;
    return radiiOf(LinearLoop(changed, geometry, plant));
  };
  return {kGainNames[static_cast<std::size_t>(gain)], gainOf(present, gain), gainBounds(gain).high, with};
}

LoopParameter varianceParameter(const ControllerParameters& controller, const GeometryParameters& geometry,
                                const PlantModel& plant, const char* name,
                                std::vector<double> ControllerParameters::*variances) {
  const auto with = [=](double factor) {
    return radiiOf(LinearLoop(scaled(controller, variances, factor), geometry, plant));
  };
  return {name, 1.0, std::numeric_limits<double>::infinity(), with};
}

std::vector<LoopParameter> parametersOf(const ControllerParameters& controller, const GeometryParameters& geometry,
                                        const PlantModel& plant) {
  return {
      gainParameter(controller, geometry, plant, Gain::kappa_a), gainParameter(controller, geometry, plant, Gain::tau),
      gainParameter(controller, geometry, plant, Gain::kappa_mu),
      varianceParameter(controller, geometry, plant, "state_variances", &ControllerParameters::state_variances),
      varianceParameter(controller, geometry, plant, "sensory_variances", &ControllerParameters::sensory_variances)};
}

}  // namespace

bool isStable(const LinearLoop& loop, const LoopChange& change) {
  return loop.beliefSpectralRadius() < kStabilityLimit && loop.stable(LoopMode::lateral) &&
         loop.stable(LoopMode::straight, change) && loop.stable(LoopMode::turn, change);
}

LoopVerdict verdictOn(const LinearLoop& loop) { return {radiiOf(loop), loop.period(), loop.radiusUncertainty()}; }

ThinMargin thinMarginOf(const LinearLoop& loop, const MarginBounds& bounds) {
  return thinMarginOf([&](const LoopChange& change) { return isStable(loop, change); }, bounds);
}

Certificate certify(const ControllerParameters& controller, const GeometryParameters& geometry,
                    const PlantModel& plant) {
  const LinearLoop loop(controller, geometry, plant);
  const ModeCertificate straight = certifyMode(loop, LoopMode::straight), turn = certifyMode(loop, LoopMode::turn);
  const double radius =
      std::max({straight.spectral_radius, turn.spectral_radius, loop.spectralRadius(LoopMode::lateral)});
  const LoopVerdict verdict{{loop.beliefSpectralRadius(), radius}, loop.period(), loop.radiusUncertainty()};
  return {verdict, smaller(straight, turn), straight, turn};
}

std::vector<Sensitivity> sensitivities(const ControllerParameters& controller, const GeometryParameters& geometry,
                                       const PlantModel& plant) {
  return sensitivitiesTo(parametersOf(controller, geometry, plant));
}

Bounds gainBounds(Gain gain) {
  const auto fields = fieldsOf(ControllerParameters{});
  const std::string name = kGainNames[static_cast<std::size_t>(gain)];
  const auto field = std::find_if(fields.begin(), fields.end(), [&](const Field& f) { return f.name == name; });
  return field->bounds.value();
}

void requireInRange(const ControllerParameters& controller) { requireInRange(controller, "controller"); }

double& gainOf(ControllerParameters& controller, Gain gain) {
  if (gain == Gain::tau) return controller.tau;
  return gain == Gain::kappa_mu ? controller.kappa_mu : controller.kappa_a;
}

std::optional<StableRange> stableRange(const ControllerParameters& controller, const GeometryParameters& geometry,
                                       const PlantModel& plant, Gain gain) {
  const LineTest stable = [&](double value) {
    ControllerParameters changed = controller;
    gainOf(changed, gain) = value;
    return isStable(LinearLoop(changed, geometry, plant));
  };
  const Bounds bounds = gainBounds(gain);
  const double lowest = std::max(bounds.low, kSmallestGain);
  ControllerParameters present = controller;
  const double value = std::clamp(gainOf(present, gain), lowest, bounds.high);
  const double ratio = std::pow(10.0, 1.0 / kPointsPerDecade);
  const auto up = [&](double x) { return ratio * x; };
  const auto down = [&](double x) { return x / ratio; };

  const auto inside = nearestHolding(stable, value, lowest, bounds.high, up, down);
  if (!inside) return std::nullopt;
  const auto above = findBoundary(stable, *inside, bounds.high, up);
  const auto below = findBoundary(stable, *inside, lowest, down);
  return StableRange{below ? below->before : bounds.low, above ? above->before : bounds.high, !below, !above};
}

std::optional<Culprit> culpritOf(const ControllerParameters& controller, const GeometryParameters& geometry,
                                 const PlantModel& plant, const ControllerParameters* running) {
  std::vector<LoopParameter> parameters = parametersOf(controller, geometry, plant);
  ControllerParameters before = running != nullptr ? *running : controller;
  for (LoopParameter& parameter : parameters) {
    const auto name = std::find(kGainNames.begin(), kGainNames.end(), parameter.name);
    if (name == kGainNames.end()) continue;
    const auto gain = static_cast<Gain>(name - kGainNames.begin());
    parameter.fallback = gainOf(before, gain);
    parameter.changed = parameter.fallback != parameter.value;
    parameter.range = [=] { return stableRange(controller, geometry, plant, gain); };
  }
  return findCulprit(parameters);
}

}  // namespace jackal_aic
