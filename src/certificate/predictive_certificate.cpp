#include "jackal_aic/certificate/predictive_certificate.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "periodic_system.hpp"

namespace jackal_aic {
namespace {

constexpr double kSmallestGainFactor = 1e-3;
constexpr int kMostExtraActionPeriods = 250;  // bounds the size of the map

double gainBoundary(const PredictiveLinearLoop& loop, double end, double none) {
  const double ratio = end > 1.0 ? 1.1 : 1.0 / 1.1;
  const auto boundary = findBoundary(
      [&](double factor) {
        return loop.worstSpectralRadius({factor, 0.0}) < kStabilityLimit;
      },
      1.0, end, [&](double factor) { return ratio * factor; });
  return boundary ? boundary->before : none;
}

/// Change of the robot's dead time up to `end` at which the verdict changes.
double delayBoundary(const PredictiveLinearLoop& loop, double end) {
  const double period = 1.0 / loop.parameters().action_rate;
  const double stride = std::copysign(0.25 * period, end);
  if (end == 0.0) return 0.0;
  const auto boundary = findBoundary(
      [&](double extra) {
        return loop.worstSpectralRadius({1.0, extra}) < kStabilityLimit;
      },
      0.0, end, [&](double extra) { return 1.1 * extra + stride; });
  return boundary ? boundary->before : end;
}

bool stable(const PredictiveLinearLoop& loop, const RobotChange& change = {}) {
  return loop.beliefSpectralRadius() < kStabilityLimit && loop.worstSpectralRadius(change) < kStabilityLimit;
}

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

std::string text(double value, int digits = 3) {
  std::ostringstream out;
  out.precision(digits);
  out << value;
  return out.str();
}

std::string atLeast(double value, double bound, const char* unit) {
  return (value >= bound ? "more than " : "") + text(value) + unit;
}

std::string instability(const PredictiveLinearLoop& loop) {
  const bool belief = loop.beliefSpectralRadius() >= kStabilityLimit;
  const double uncertainty = loop.radiusUncertainty();
  if (!belief && loop.worstSpectralRadius() - uncertainty < kStabilityLimit) {
    return "the closed loop cannot be told from one at the limit of stability: spectral radius 1 within " +
           text(uncertainty);
  }
  return (belief ? "the belief diverges: spectral radius " : "the closed loop diverges: spectral radius ") +
         text(belief ? loop.beliefSpectralRadius() : loop.worstSpectralRadius(), 4) + ", must be below 1";
}

/// What differs between robot and model, or else the parameter to which the radius is most sensitive.
std::string blame(const PredictiveParameters& parameters, const PlantModel& model, const PlantModel& robot) {
  if (!stable(PredictiveLinearLoop(parameters, model, model))) {
    const auto list = sensitivities(parameters, model, model);
    if (list.empty()) return "no parameter changes that";
    return "predictive." + list.front().parameter + " is most to blame";
  }
  return "with plant_model.dead_time = " + text(model.dead_time) + " s, lag = " + text(model.lag) +
         " s, gain = " + text(model.gain) + " it would be stable, but the robot has " + text(robot.dead_time) + " s, " +
         text(robot.lag) + " s, " + text(robot.gain) +
         ": identify it anew or lower predictive.disturbance_process_noise";
}

}  // namespace

PredictiveCertificate certify(const PredictiveParameters& parameters, const PlantModel& model,
                              const PlantModel& robot) {
  const PredictiveLinearLoop loop(parameters, model, robot);
  PredictiveCertificate certificate{};
  certificate.period = loop.period();
  certificate.belief_spectral_radius = loop.beliefSpectralRadius();
  certificate.loop_spectral_radius = loop.worstSpectralRadius();
  certificate.radius_uncertainty = loop.radiusUncertainty();
  certificate.gain_margin = certificate.gain_reduction = 1.0;
  if (!certificate.stable()) return certificate;
  certificate.gain_margin = gainBoundary(loop, kLargestGainMargin, kLargestGainMargin);
  certificate.gain_reduction = gainBoundary(loop, kSmallestGainFactor, 0.0);
  const double longest = std::min(kLargestDelayMargin, kMostExtraActionPeriods / parameters.action_rate);
  certificate.delay_margin = delayBoundary(loop, longest);
  certificate.delay_reduction = -delayBoundary(loop, -robot.dead_time);
  return certificate;
}

std::string thinMargin(const PredictiveLinearLoop& loop, const MarginBounds& bounds) {
  if (!stable(loop, {bounds.gain, 0.0})) return "unstable with " + text(bounds.gain) + " times the robot's gain";
  if (!stable(loop, {1.0, bounds.delay})) return "unstable with " + text(bounds.delay) + " s more dead time";
  return "";
}

std::vector<Sensitivity> sensitivities(const PredictiveParameters& parameters, const PlantModel& model,
                                       const PlantModel& robot) {
  constexpr double kStep = 0.01;
  const bool belief = PredictiveLinearLoop(parameters, model, robot).beliefSpectralRadius() >= kStabilityLimit;
  const auto log_radius = [&](const Knob& knob, double factor) {
    PredictiveParameters changed = parameters;
    changed.*knob.value = factor * parameters.*knob.value;
    const PredictiveLinearLoop loop(changed, model, robot);
    return std::log(belief ? loop.beliefSpectralRadius() : loop.worstSpectralRadius());
  };
  std::vector<Sensitivity> list;
  for (const Knob& knob : kKnobs) {
    const double above = parameters.*knob.value * (1.0 + kStep) > knob.largest ? 1.0 : 1.0 + kStep;
    const double slope = (log_radius(knob, above) - log_radius(knob, 1.0 - kStep)) / std::log(above / (1.0 - kStep));
    if (std::isfinite(slope) && slope != 0.0) list.push_back({knob.name, slope});
  }
  std::stable_sort(list.begin(), list.end(),
                   [](const auto& a, const auto& b) { return std::abs(a.value) > std::abs(b.value); });
  return list;
}

std::string advice(const PredictiveCertificate& certificate, const PredictiveParameters& parameters,
                   const PlantModel& model, const PlantModel& robot, const MarginBounds& bounds) {
  if (!certificate.stable()) {
    return "Unstable: " + instability(PredictiveLinearLoop(parameters, model, robot)) + "; " +
           blame(parameters, model, robot) + ".";
  }
  const std::string room = "the robot's gain may be " + atLeast(certificate.gain_margin, kLargestGainMargin, "") +
                           " times as large, or its dead time " +
                           atLeast(certificate.delay_margin, kLargestDelayMargin, " s") +
                           " longer, before the loop oscillates";
  if (certificate.keeps(bounds)) return "Stable with room: " + room + ".";
  return "Stable, but with a thin margin (below " + text(bounds.gain) + " or " + text(bounds.delay) + " s): " + room +
         "; lower disturbance_process_noise = " + text(parameters.disturbance_process_noise) + ".";
}

void requireStable(const PredictiveParameters& parameters, const PlantModel& model, const PlantModel& robot) {
  const PredictiveLinearLoop loop(parameters, model, robot);
  if (stable(loop)) return;
  throw ParameterError("predictive: " + instability(loop) + "; " + blame(parameters, model, robot));
}

}  // namespace jackal_aic
