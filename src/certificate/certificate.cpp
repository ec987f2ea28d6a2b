#include "jackal_aic/certificate/certificate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kGainStep = 1.2;       // factor on the gain from one point of the walk to the next
constexpr double kDelayStep = 0.25;     // action periods of extra dead time, at first
constexpr double kDelayGrowth = 1.1;    // factor on that step from point to point, to reach long delays soon
constexpr int kHalvings = 20;           // of the step in which the verdict changes
constexpr int kMostExtraPeriods = 250;  // largest extra dead time [action periods]; it bounds the size of the map

/// Last point before the verdict changes on the way from `start` along next(x) to `end`; `none` if it does not change.
template <class Stable, class Next>
double boundary(const Stable& stable, double start, double end, double none, const Next& next) {
  const bool at_start = stable(start);
  for (double before = start; before != end;) {
    double after = end > start ? std::min(next(before), end) : std::max(next(before), end);
    if (stable(after) == at_start) {
      before = after;
      continue;
    }
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = 0.5 * (before + after);
      (stable(middle) == at_start ? before : after) = middle;
    }
    return before;
  }
  return none;
}

/// Factor on the gain at which the verdict changes on the way from 1 to `end`; `none` if it does not.
template <class Stable>
double gainBoundary(const Stable& stable, double end, double none) {
  const double ratio = end > 1.0 ? kGainStep : 1.0 / kGainStep;
  return boundary(stable, 1.0, end, none, [&](double factor) { return ratio * factor; });
}

/// Extra dead time [s] at which the verdict changes on the way from 0 to `end`; `end` if it does not.
template <class Stable>
double delayBoundary(const Stable& stable, double action_period, double end) {
  const double stride = std::copysign(kDelayStep * action_period, end);
  return boundary(stable, 0.0, end, end, [&](double extra) { return kDelayGrowth * extra + stride; });
}

ModeCertificate certifyMode(const LinearLoop& loop, LoopMode mode) {
  const SpectralRadius radius = loop.worstSpectralRadius(mode);
  ModeCertificate certificate;
  certificate.spectral_radius = radius.upper();
  certificate.radius_uncertainty = 2.0 * radius.uncertainty;
  const auto at_gain = [&](double factor) { return loop.stable(mode, {factor, 0.0}); };
  const auto at_delay = [&](double extra) { return loop.stable(mode, {1.0, extra}); };
  const double shorter = delayBoundary(at_delay, loop.actionPeriod(), -loop.robot().dead_time);
  certificate.gain_reduction = gainBoundary(at_gain, 1.0 / kLargestGainMargin, 0.0);
  if (radius.upper() < kStabilityLimit) {
    certificate.gain_margin = gainBoundary(at_gain, kLargestGainMargin, kLargestGainMargin);
    certificate.delay_margin = delayBoundary(at_delay, loop.actionPeriod(), largestDelayMargin(loop));
    certificate.delay_reduction = std::abs(shorter);
  } else {
    certificate.gain_margin = certificate.gain_reduction;
    certificate.delay_margin = shorter;
  }
  return certificate;
}

/// The margins that are closer to the limit.
Margins smaller(const Margins& a, const Margins& b) {
  return {std::min(a.gain_margin, b.gain_margin), std::max(a.gain_reduction, b.gain_reduction),
          std::min(a.delay_margin, b.delay_margin), std::min(a.delay_reduction, b.delay_reduction)};
}

/// A margin in words: "more than" if the search ended at its bound.
std::string atLeast(double value, double bound) {
  return fmt::format("{}{:.3g}", value >= bound ? "more than " : "", value);
}

std::string instability(const Certificate& certificate) {
  const bool belief = certificate.belief_spectral_radius >= kStabilityLimit;
  const double radius = belief ? certificate.belief_spectral_radius : certificate.loop_spectral_radius;
  if (!belief && radius - certificate.radius_uncertainty < kStabilityLimit) {
    return fmt::format("the closed loop is at the limit of stability: spectral radius 1 within {:.3g}",
                       certificate.radius_uncertainty);
  }
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
  certificate.straight = certificate.turn = certifyMode(loop, LoopMode::straight);
  if (loop.modes().size() > 1) certificate.turn = certifyMode(loop, LoopMode::turn);
  static_cast<Margins&>(certificate) = smaller(certificate.straight, certificate.turn);
  const ModeCertificate& worse =
      certificate.turn.spectral_radius > certificate.straight.spectral_radius ? certificate.turn : certificate.straight;
  certificate.belief_spectral_radius = loop.beliefSpectralRadius();
  certificate.loop_spectral_radius = worse.spectral_radius;
  certificate.radius_uncertainty = worse.radius_uncertainty;
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
  const char* outside = loop.bounded() ? " Action bound and standstill are outside the certificate." : "";
  if (certificate.keeps(bounds)) return "Stable with room: " + room + "." + outside;
  return fmt::format(
      "Stable, but with a thin margin (below {:.3g} or {:.3g} s): {}; lower {}.{}", bounds.gain, bounds.delay, room,
      loop.predictive() ? "predictive.disturbance_process_noise" : fmt::format("kappa_a = {:.3g}", loop.actionGain()),
      outside);
}

void requireStable(const LinearLoop& loop) {
  if (loop.stable()) return;
  const Certificate certificate = certify(loop);
  throw ParameterError(std::string(loop.predictive() ? "predictive: " : "controller: ") + instability(certificate) +
                       "; " + remedy(certificate, loop));
}

}  // namespace jackal_aic
