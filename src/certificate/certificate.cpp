#include "jackal_aic/certificate/certificate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kStep = 1.1;           // factor from one point of a walk to the next
constexpr double kDelayUnit = 2.5;      // action periods of extra dead time, by which delays are walked like gains
constexpr int kMostExtraPeriods = 250;  // largest extra dead time [action periods]; it bounds the size of the map

/// Last factor at which a loop is as at 1, on the way from 1 up to `end`; infinite if the verdict does not change.
template <class Stable>
double boundary(const Stable& stable, double end) {
  const bool at_start = stable(1.0);
  for (double before = 1.0; before < end;) {
    double after = std::min(kStep * before, end);
    if (stable(after) == at_start) {
      before = after;
      continue;
    }
    for (int halving = 0; halving < 20; ++halving) {
      const double middle = 0.5 * (before + after);
      (stable(middle) == at_start ? before : after) = middle;
    }
    return before;
  }
  return HUGE_VAL;
}

Margins marginsOf(const LinearLoop& loop, LoopMode mode) {
  const auto at_gain = [&](double gain) { return loop.stable(mode, {gain, 0.0}); };
  const double unit = kDelayUnit * loop.actionPeriod();
  /// Extra dead time at which the verdict changes on the way to `end`; `end` if it does not.
  const auto delayBoundary = [&](double end) {
    const auto extra = [&](double factor) { return std::copysign((factor - 1.0) * unit, end); };
    const auto at_delay = [&](double factor) { return loop.stable(mode, {1.0, extra(factor)}); };
    const double found = boundary(at_delay, 1.0 + std::abs(end) / unit);
    return std::isinf(found) ? end : extra(found);
  };
  Margins margins{loop.worstSpectralRadius(mode)};
  margins.gain_reduction = 1.0 / boundary([&](double factor) { return at_gain(1.0 / factor); }, kLargestGainMargin);
  const double shorter = delayBoundary(-loop.robot().dead_time);
  if (margins.spectral_radius < kStabilityLimit) {
    margins.gain_margin = std::min(boundary(at_gain, kLargestGainMargin), kLargestGainMargin);
    margins.delay_margin = delayBoundary(largestDelayMargin(loop));
    margins.delay_reduction = std::abs(shorter);
  } else {
    margins.gain_margin = margins.gain_reduction;
    margins.delay_margin = shorter;
  }
  return margins;
}

/// The larger radius, and the margins that are closer to the limit.
Margins worse(const Margins& a, const Margins& b) {
  return {std::max(a.spectral_radius, b.spectral_radius), std::min(a.gain_margin, b.gain_margin),
          std::max(a.gain_reduction, b.gain_reduction), std::min(a.delay_margin, b.delay_margin),
          std::min(a.delay_reduction, b.delay_reduction)};
}

/// A margin in words: "more than" if the search ended at its bound.
std::string atLeast(double value, double bound) {
  return fmt::format("{}{:.3g}", value >= bound ? "more than " : "", value);
}

std::string instability(const Certificate& certificate) {
  const bool belief = certificate.belief_spectral_radius >= kStabilityLimit;
  const double radius = belief ? certificate.belief_spectral_radius : certificate.spectral_radius;
  return fmt::format("the {} diverges: spectral radius {:.4g}, must be below 1",
                     belief ? "belief update" : "closed loop", radius);
}

std::string remedy(const Certificate& certificate, const LinearLoop& loop) {
  const char* gain = loop.predictive() ? "predictive.action_learning_rate" : "kappa_a";
  if (loop.actionGain() == 0.0) return fmt::format("{} = 0 never corrects the action: raise it", gain);
  if (!loop.predictive() && certificate.belief_spectral_radius >= kStabilityLimit) {
    return "use integrator: exact, or raise tau";
  }
  std::string stable;
  if (certificate.delay_margin > -loop.robot().dead_time) {
    stable = fmt::format("with a dead time below {:.3g} s", loop.robot().dead_time + certificate.delay_margin);
  }
  if (!loop.predictive()) {
    if (certificate.gain_margin > 0.0) {
      return fmt::format("kappa_a = {:.3g} is too large: stable below {:.3g}", loop.actionGain(),
                         certificate.gain_margin * loop.actionGain());
    }
    return fmt::format("no kappa_a from {:.3g} to {:.3g} is stable{}", 1.0 / kLargestGainMargin * loop.actionGain(),
                       loop.actionGain(), stable.empty() ? ", nor a shorter dead time" : "; stable " + stable);
  }
  if (stable.empty() && certificate.gain_margin > 0.0) {
    stable = fmt::format("with a gain below {:.3g}", loop.robot().gain * certificate.gain_margin);
  }
  const PlantModel &model = loop.model(), &robot = loop.robot();
  return fmt::format(
      "the robot has plant_model.dead_time = {:.3g} s, lag = {:.3g} s, gain = {:.3g}, the controller believes {:.3g} "
      "s, {:.3g} s, {:.3g}{}; identify the robot or lower predictive.disturbance_process_noise",
      robot.dead_time, robot.lag, robot.gain, model.dead_time, model.lag, model.gain,
      stable.empty() ? "" : ": stable " + stable);
}

}  // namespace

double largestDelayMargin(const LinearLoop& loop) {
  return std::min(kLargestDelayMargin, kMostExtraPeriods * loop.actionPeriod());
}

Certificate certify(const LinearLoop& loop) {
  Certificate certificate;
  certificate.straight = certificate.turn = marginsOf(loop, LoopMode::straight);
  if (loop.modes().size() > 1) certificate.turn = marginsOf(loop, LoopMode::turn);
  static_cast<Margins&>(certificate) = worse(certificate.straight, certificate.turn);
  certificate.belief_spectral_radius = loop.beliefSpectralRadius();
  certificate.period = loop.period();
  return certificate;
}

Certificate certify(const ControllerParameters& controller, const GeometryParameters& geometry,
                    const PlantModel& robot) {
  return certify(LinearLoop(controller, geometry, robot));
}

Certificate certify(const PredictiveParameters& parameters, const PlantModel& model, const PlantModel& robot) {
  return certify(LinearLoop(parameters, model, robot));
}

std::string advice(const Certificate& certificate, const LinearLoop& loop, const MarginBounds& bounds) {
  if (!certificate.stable()) return "Unstable: " + instability(certificate) + "; " + remedy(certificate, loop) + ".";
  const std::string room = fmt::format(
      "{} may rise by a factor of {} or the dead time by {} s before the loop oscillates",
      loop.predictive() ? "the robot's gain" : "kappa_a", atLeast(certificate.gain_margin, kLargestGainMargin),
      atLeast(certificate.delay_margin, largestDelayMargin(loop)));
  if (certificate.keeps(bounds)) return "Stable with room: " + room + ".";
  return fmt::format(
      "Stable, but with a thin margin (below {:.3g} or {:.3g} s): {}; lower {}.", bounds.gain, bounds.delay, room,
      loop.predictive() ? "predictive.disturbance_process_noise" : fmt::format("kappa_a = {:.3g}", loop.actionGain()));
}

void requireStable(const LinearLoop& loop) {
  if (loop.stable()) return;
  const Certificate certificate = certify(loop);
  throw ParameterError(std::string(loop.predictive() ? "predictive: " : "controller: ") + instability(certificate) +
                       "; " + remedy(certificate, loop));
}

}  // namespace jackal_aic
