#include "jackal_aic/certificate/advice.hpp"

#include <optional>
#include <sstream>

namespace jackal_aic {
namespace {

std::string text(double value, int digits = 3) {
  std::ostringstream out;
  out.precision(digits);
  out << value;
  return out.str();
}

std::string atLeast(double value, double bound, const char* unit) {
  return (value >= bound ? "more than " : "") + text(value) + unit;
}

std::string instability(const LoopVerdict& verdict) {
  const bool belief = verdict.belief_spectral_radius >= kStabilityLimit;
  const double radius = belief ? verdict.belief_spectral_radius : verdict.loop_spectral_radius;
  if (!belief && radius - verdict.radius_uncertainty < kStabilityLimit) {
    return "the closed loop cannot be told from one at the limit of stability: spectral radius 1 within " +
           text(verdict.radius_uncertainty);
  }
  return (belief ? "the belief update diverges: spectral radius " : "the closed loop diverges: spectral radius ") +
         text(radius, 4) + ", must be below 1";
}

/// @param value present, which is not stable: an end of the range that it is at does not belong to it.
std::string rangeText(const StableRange& range, double value) {
  const bool low_ends = !range.low_is_bound || value <= range.low, high_ends = !range.high_is_bound;
  if (low_ends && high_ends) return "stable between " + text(range.low) + " and " + text(range.high);
  if (low_ends) return "stable above " + text(range.low);
  return high_ends ? "stable below " + text(range.high) : "stable at any value";
}

/// @param prefix of the key.
std::string blame(const std::optional<Culprit>& culprit, const std::string& prefix) {
  if (!culprit) return "no parameter changes that";
  const std::string most = prefix + culprit->parameter + " = " + text(culprit->value) + " is most to blame";
  if (culprit->range) return most + " (" + rangeText(*culprit->range, culprit->value) + ", the others as they are)";
  if (culprit->stable_with) return most + " (stable with " + text(*culprit->stable_with) + ", the others as they are)";
  return most + ", but another value of it alone does not help";
}

/// What differs between robot and model if that is it, else the parameter most to blame.
std::string blame(const PredictiveParameters& parameters, const PlantModel& model, const PlantModel& robot,
                  const PredictiveParameters* running = nullptr) {
  if (!isStable(PredictiveLinearLoop(parameters, model, model))) {
    return blame(culpritOf(parameters, model, model, running), "predictive.");
  }
  return "with plant_model.dead_time = " + text(model.dead_time) + " s, lag = " + text(model.lag) +
         " s, gain = " + text(model.gain) + " it would be stable, but the robot has " + text(robot.dead_time) + " s, " +
         text(robot.lag) + " s, " + text(robot.gain) +
         ": identify it anew or lower predictive.disturbance_process_noise";
}

/// @param room what may change before the loop oscillates; @param help what makes the margin larger.
std::string marginAdvice(const Margins& margins, const MarginBounds& bounds, const std::string& room,
                         const std::string& help) {
  if (margins.keeps(bounds)) return "Stable with room: " + room + ".";
  return "Stable, but with a thin margin (below " + text(bounds.gain) + " or " + text(bounds.delay) + " s): " + room +
         "; lower " + help + ".";
}

std::string thinText(ThinMargin thin, const MarginBounds& bounds, const char* gain) {
  if (thin == ThinMargin::gain) return "unstable with " + text(bounds.gain) + " times " + gain;
  return thin == ThinMargin::delay ? "unstable with " + text(bounds.delay) + " s more dead time" : "";
}

}  // namespace

std::string advice(const Certificate& certificate, const ControllerParameters& controller,
                   const GeometryParameters& geometry, const PlantModel& plant, const MarginBounds& bounds) {
  if (!certificate.stable()) {
    return "Unstable: " + instability(certificate) + "; " + blame(culpritOf(controller, geometry, plant), "") + ".";
  }
  return marginAdvice(certificate, bounds,
                      "kappa_a may rise by a factor of " + atLeast(certificate.gain_margin, kLargestGainMargin, "") +
                          " or the dead time by " + atLeast(certificate.delay_margin, kLargestDelayMargin, " s") +
                          " before the loop oscillates",
                      "kappa_a = " + text(controller.kappa_a));
}

std::string advice(const PredictiveCertificate& certificate, const PredictiveParameters& parameters,
                   const PlantModel& model, const PlantModel& robot, const MarginBounds& bounds) {
  if (!certificate.stable()) {
    return "Unstable: " + instability(certificate) + "; " + blame(parameters, model, robot) + ".";
  }
  return marginAdvice(certificate, bounds,
                      "the robot's gain may be " + atLeast(certificate.gain_margin, kLargestGainMargin, "") +
                          " times as large, or its dead time " +
                          atLeast(certificate.delay_margin, kLargestDelayMargin, " s") +
                          " longer, before the loop oscillates",
                      "disturbance_process_noise = " + text(parameters.disturbance_process_noise));
}

std::string thinMargin(const LinearLoop& loop, const MarginBounds& bounds) {
  return thinText(thinMarginOf(loop, bounds), bounds, "the kappa_a");
}

std::string thinMargin(const PredictiveLinearLoop& loop, const MarginBounds& bounds) {
  return thinText(thinMarginOf(loop, bounds), bounds, "the robot's gain");
}

void requireStable(const ControllerParameters& controller, const GeometryParameters& geometry, const PlantModel& plant,
                   const ControllerParameters* running) {
  const LinearLoop loop(controller, geometry, plant);
  if (isStable(loop)) return;
  throw ParameterError("controller: " + instability(verdictOn(loop)) + "; " +
                       blame(culpritOf(controller, geometry, plant, running), ""));
}

void requireStable(const PredictiveParameters& parameters, const PlantModel& model, const PlantModel& robot,
                   const PredictiveParameters* running) {
  const PredictiveLinearLoop loop(parameters, model, robot);
  if (isStable(loop)) return;
  throw ParameterError("predictive: " + instability(verdictOn(loop)) + "; " + blame(parameters, model, robot, running));
}

}  // namespace jackal_aic
