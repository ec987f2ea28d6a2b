#include "jackal_aic/certificate/predictive_certificate.hpp"

#include <algorithm>

#include "margin_search.hpp"

namespace jackal_aic {
namespace {

struct Knob {
  const char* name;
  double PredictiveParameters::*value;
  double largest;  // of its range
};

constexpr Knob kKnobs[] = {{"action_learning_rate", &PredictiveParameters::action_learning_rate, 1.0},
                           {"belief_learning_rate", &PredictiveParameters::belief_learning_rate, 1.0},
                           {"wheel_variance", &PredictiveParameters::wheel_variance, 1e3},
                           {"speed_process_noise", &PredictiveParameters::speed_process_noise, 1e3},
                           {"disturbance_process_noise", &PredictiveParameters::disturbance_process_noise, 1e3}};

SpectralRadii radiiOf(const PredictiveLinearLoop& loop) {
  return {loop.beliefSpectralRadius(), loop.worstSpectralRadius()};
}

std::vector<LoopParameter> parametersOf(const PredictiveParameters& parameters, const PlantModel& model,
                                        const PlantModel& robot) {
  std::vector<LoopParameter> list;
  for (const Knob& knob : kKnobs) {
    const auto with = [=](double value) {
      PredictiveParameters changed = parameters;
      changed.*knob.value = value;
      return radiiOf(PredictiveLinearLoop(changed, model, robot));
    };
    list.push_back({knob.name, parameters.*knob.value, knob.largest, with});
  }
  return list;
}

}  // namespace

PredictiveCertificate certify(const PredictiveParameters& parameters, const PlantModel& model,
                              const PlantModel& robot) {
  const PredictiveLinearLoop loop(parameters, model, robot);
  const LoopVerdict verdict = verdictOn(loop);
  const SearchedLoop searched{verdict.stable(),
                              [&](const LoopChange& change) { return isStable(loop, change); },
                              [&](const LoopChange& change) { return loop.periodMap(change); },
                              loop.singleRate() && robot.lag > 0.0,
                              loop.period(),
                              loop.longestPhase(),
                              1.0 / parameters.action_rate,
                              robot.dead_time};
  PredictiveCertificate certificate{verdict, findMargins(searched)};
  if (certificate.stable()) {
    certificate.delay_reduction = -delayBoundary(searched.stable, searched.action_period, -robot.dead_time);
  }
  return certificate;
}

bool isStable(const PredictiveLinearLoop& loop, const LoopChange& change) {
  return loop.beliefSpectralRadius() < kStabilityLimit && loop.stable(change);
}

LoopVerdict verdictOn(const PredictiveLinearLoop& loop) {
  return {radiiOf(loop), loop.period(), loop.radiusUncertainty()};
}

ThinMargin thinMarginOf(const PredictiveLinearLoop& loop, const MarginBounds& bounds) {
  return thinMarginOf([&](const LoopChange& change) { return isStable(loop, change); }, bounds);
}

std::vector<Sensitivity> sensitivities(const PredictiveParameters& parameters, const PlantModel& model,
                                       const PlantModel& robot) {
  return sensitivitiesTo(parametersOf(parameters, model, robot));
}

std::optional<Culprit> culpritOf(const PredictiveParameters& parameters, const PlantModel& model,
                                 const PlantModel& robot, const PredictiveParameters* running) {
  std::vector<LoopParameter> list = parametersOf(parameters, model, robot);
  const PredictiveParameters other = running != nullptr ? *running : PredictiveParameters{};
  for (std::size_t i = 0; i < list.size(); ++i) {
    list[i].fallback = other.*kKnobs[i].value;
    list[i].changed = running != nullptr && list[i].fallback != list[i].value;
  }
  return findCulprit(list);
}

}  // namespace jackal_aic
