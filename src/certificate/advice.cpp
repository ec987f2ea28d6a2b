#include "jackal_aic/certificate/advice.hpp"

#include <fmt/format.h>

#include <optional>

namespace jackal_aic {
namespace {

/// A margin as the search for it ended: it may be larger than the largest that is looked for.
std::string atLeast(double value, double bound) {
  return fmt::format("{}{:.3g}", value >= bound ? "more than " : "", value);
}

std::string instability(const LoopVerdict& verdict) {
  const bool belief = verdict.belief_spectral_radius >= kStabilityLimit;
  const double radius = belief ? verdict.belief_spectral_radius : verdict.loop_spectral_radius;
  if (!belief && radius - verdict.radius_uncertainty < kStabilityLimit) {
    return fmt::format(
        "the closed loop cannot be told from one at the limit of stability: spectral radius 1 within {:.3g}",
        verdict.radius_uncertainty);
  }
  return fmt::format("the {} diverges: spectral radius {:.4g}, must be below 1",
                     belief ? "belief update" : "closed loop", radius);
}

/// @param value present, which is not stable: an end of the range that it is at does not belong to it.
std::string rangeText(const StableRange& range, double value) {
  const bool low_ends = !range.low_is_bound || value <= range.low, high_ends = !range.high_is_bound;
  if (low_ends && high_ends) return fmt::format("stable between {:.3g} and {:.3g}", range.low, range.high);
  if (low_ends) return fmt::format("stable above {:.3g}", range.low);
  return high_ends ? fmt::format("stable below {:.3g}", range.high) : "stable at any value";
}

/// @param prefix of the key.
std::string blame(const std::optional<Culprit>& culprit, const std::string& prefix) {
  if (!culprit) return "no parameter changes that";
  const std::string most = fmt::format("{}{} = {:.3g} is most to blame", prefix, culprit->parameter, culprit->value);
  if (culprit->range) {
    return fmt::format("{} ({}, the others as they are)", most, rangeText(*culprit->range, culprit->value));
  }
  if (culprit->stable_with) {
    return fmt::format("{} (stable with {:.3g}, the others as they are)", most, *culprit->stable_with);
  }
  return most + ", but another value of it alone does not help";
}

/// What differs between robot and model if that is it, else the parameter most to blame.
std::string blame(const PredictiveParameters& parameters, const PlantModel& model, const PlantModel& robot,
                  const PredictiveParameters* running = nullptr) {
  if (!isStable(PredictiveLinearLoop(parameters, model, model))) {
    return blame(culpritOf(parameters, model, model, running), "predictive.");
  }
  return fmt::format(
      "with plant_model.dead_time = {:.3g} s, lag = {:.3g} s, gain = {:.3g} it would be stable, but the robot has "
      "{:.3g} s, {:.3g} s, {:.3g}: identify it anew or lower predictive.disturbance_process_noise",
      model.dead_time, model.lag, model.gain, robot.dead_time, robot.lag, robot.gain);
}

/// @param room what may change before the loop oscillates; @param help what makes the margin larger.
std::string marginAdvice(const Margins& margins, const MarginBounds& bounds, const std::string& room,
                         const std::string& help) {
  if (margins.keeps(bounds)) return "Stable with room: " + room + ".";
  return fmt::format("Stable, but with a thin margin (below {:.3g} or {:.3g} s): {}; lower {}.", bounds.gain,
                     bounds.delay, room, help);
}

std::string thinText(ThinMargin thin, const MarginBounds& bounds, const char* gain) {
  if (thin == ThinMargin::gain) return fmt::format("unstable with {:.3g} times {}", bounds.gain, gain);
  return thin == ThinMargin::delay ? fmt::format("unstable with {:.3g} s more dead time", bounds.delay) : "";
}

}  // namespace

std::string advice(const Certificate& certificate, const ControllerParameters& controller,
                   const GeometryParameters& geometry, const PlantModel& plant, const MarginBounds& bounds) {
  if (!certificate.stable()) {
    return "Unstable: " + instability(certificate) + "; " + blame(culpritOf(controller, geometry, plant), "") + ".";
  }
  return marginAdvice(certificate, bounds,
                      fmt::format("kappa_a may rise by a factor of {} or the dead time by {} s before the loop "
                                  "oscillates",
                                  atLeast(certificate.gain_margin, kLargestGainMargin),
                                  atLeast(certificate.delay_margin, largestDelayMargin(controller.actionStep()))),
                      fmt::format("kappa_a = {:.3g}", controller.kappa_a));
}

std::string advice(const PredictiveCertificate& certificate, const PredictiveParameters& parameters,
                   const PlantModel& model, const PlantModel& robot, const MarginBounds& bounds) {
  if (!certificate.stable()) {
    return "Unstable: " + instability(certificate) + "; " + blame(parameters, model, robot) + ".";
  }
  return marginAdvice(certificate, bounds,
                      fmt::format("the robot's gain may be {} times as large, or its dead time {} s longer, before "
                                  "the loop oscillates",
                                  atLeast(certificate.gain_margin, kLargestGainMargin),
                                  atLeast(certificate.delay_margin, largestDelayMargin(1.0 / parameters.action_rate))),
                      fmt::format("disturbance_process_noise = {:.3g}", parameters.disturbance_process_noise));
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
