#include "jackal_aic/certificate/closed_loop_certificate.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <sstream>

#include "periodic_system.hpp"

namespace jackal_aic {
namespace {

constexpr double kSmallestGainFactor = 1e-3;
constexpr int kMostExtraActionPeriods = 250;  // bounds the size of the map
constexpr int kPointsPerDecade = 16;
constexpr double kSmallestGain = 1e-9;  // where a scan begins if a gain may be zero

/// Factor on kappa_a at which the verdict changes; `none` if it does not up to `end`.
double gainBoundary(const LinearLoop& loop, LoopMode mode, double end, double none) {
  const double ratio = end > 1.0 ? 1.1 : 1.0 / 1.1;
  const auto boundary = findBoundary(
      [&](double factor) {
        return loop.worstSpectralRadius(mode, {factor, 0.0}) < kStabilityLimit;
      },
      1.0, end, [&](double factor) { return ratio * factor; });
  return boundary ? boundary->before : none;
}

/// Extra dead time at which the verdict changes: more of it if stable, less if not.
double delayBoundary(const LinearLoop& loop, LoopMode mode, bool stable) {
  const double period = loop.controller().actionStep();
  const double longest = std::min(kLargestDelayMargin, kMostExtraActionPeriods * period);
  const double stride = stable ? 0.25 * period : -0.25 * period;
  const double end = stable ? longest : -loop.plant().dead_time;
  const auto boundary = findBoundary(
      [&](double extra) {
        return loop.worstSpectralRadius(mode, {1.0, extra}) < kStabilityLimit;
      },
      0.0, end, [&](double extra) { return 1.1 * extra + stride; });
  return boundary ? boundary->before : end;
}

ModeCertificate certifyMode(const LinearLoop& loop, LoopMode mode) {
  ModeCertificate certificate{};
  certificate.spectral_radius = loop.worstSpectralRadius(mode);
  const bool stable = certificate.spectral_radius < kStabilityLimit;
  certificate.gain_reduction = gainBoundary(loop, mode, kSmallestGainFactor, 0.0);
  certificate.gain_margin =
      stable ? gainBoundary(loop, mode, kLargestGainMargin, kLargestGainMargin) : certificate.gain_reduction;
  certificate.delay_margin = delayBoundary(loop, mode, stable);
  return certificate;
}

/// The radius whose cause is asked for.
double decisiveRadius(const LinearLoop& loop) {
  const double belief = loop.beliefSpectralRadius();
  return belief >= kStabilityLimit ? belief : loop.worstSpectralRadius();
}

ControllerParameters scaled(ControllerParameters controller, const std::string& parameter, double factor) {
  if (parameter == "kappa_a") controller.kappa_a *= factor;
  if (parameter == "tau") controller.tau *= factor;
  if (parameter == "kappa_mu") controller.kappa_mu *= factor;
  for (double& variance : controller.state_variances) variance *= parameter == "state_variances" ? factor : 1.0;
  for (double& variance : controller.sensory_variances) variance *= parameter == "sensory_variances" ? factor : 1.0;
  return controller;
}

/// Picks the bounds of one field out of describeFields().
class BoundsOf {
 public:
  explicit BoundsOf(std::string name) : name_(std::move(name)) {}
  void field(const char* name, double&, Bounds bounds, const char*, Presence) {
    if (name == name_) bounds_ = bounds;
  }
  void field(const char*, int&, Bounds, const char*, Presence) {}
  void field(const char*, std::vector<double>&, Bounds, std::size_t, const char*, Presence) {}
  template <class Enum, std::size_t N>
  void field(const char*, Enum&, const std::array<const char*, N>&, Presence) {}
  Bounds bounds() const { return bounds_; }

 private:
  std::string name_;
  Bounds bounds_{};
};

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

std::string text(double value, int digits = 3) {
  std::ostringstream out;
  out.precision(digits);
  out << value;
  return out.str();
}

std::string rangeText(const StableRange& range) {
  if (range.low_is_bound && range.high_is_bound) return "stable at any value";
  if (range.low_is_bound) return "stable below " + text(range.high);
  if (range.high_is_bound) return "stable above " + text(range.low);
  return "stable from " + text(range.low) + " to " + text(range.high);
}

/// The gain that is most to blame for an instability and what to do about it. The variances only stand in the list of
/// sensitivities: the three gains do all they can.
std::string blame(const ControllerParameters& controller, const GeometryParameters& geometry, const PlantModel& plant) {
  ControllerParameters present = controller;
  std::string most_to_blame;
  for (const Sensitivity& sensitivity : sensitivities(controller, geometry, plant)) {
    for (std::size_t i = 0; i < kGainNames.size(); ++i) {
      if (sensitivity.parameter != kGainNames[i]) continue;
      const std::string name_and_value = sensitivity.parameter + " = " + text(gainOf(present, static_cast<Gain>(i)));
      if (most_to_blame.empty()) most_to_blame = name_and_value;
      const auto range = stableRange(controller, geometry, plant, static_cast<Gain>(i));
      if (range) return name_and_value + " is most to blame (" + rangeText(*range) + ", the others as they are)";
    }
  }
  return most_to_blame + " is most to blame, but no value of a single gain is stable";
}

std::string instability(const LinearLoop& loop) {
  const bool belief = loop.beliefSpectralRadius() >= kStabilityLimit;
  const double uncertainty = loop.radiusUncertainty();
  if (!belief && loop.worstSpectralRadius() - uncertainty < kStabilityLimit) {
    return "the closed loop cannot be told from one at the limit of stability: spectral radius 1 within " +
           text(uncertainty);
  }
  return (belief ? "the belief update diverges: spectral radius " : "the closed loop diverges: spectral radius ") +
         text(decisiveRadius(loop), 4) + ", must be below 1";
}

std::string atLeast(double value, double bound, const char* unit) {
  return (value >= bound ? "more than " : "") + text(value) + unit;
}

}  // namespace

bool isStable(const LinearLoop& loop, const LoopChange& change) {
  if (loop.beliefSpectralRadius() >= kStabilityLimit || loop.worstSpectralRadius(LoopMode::lateral) >= kStabilityLimit)
    return false;
  return loop.worstSpectralRadius(LoopMode::straight, change) < kStabilityLimit &&
         loop.worstSpectralRadius(LoopMode::turn, change) < kStabilityLimit;
}

std::string thinMargin(const LinearLoop& loop, const MarginBounds& bounds) {
  if (!isStable(loop, {bounds.gain, 0.0})) return "unstable with " + text(bounds.gain) + " times the kappa_a";
  if (!isStable(loop, {1.0, bounds.delay})) return "unstable with " + text(bounds.delay) + " s more dead time";
  return "";
}

Certificate certify(const ControllerParameters& controller, const GeometryParameters& geometry,
                    const PlantModel& plant) {
  const LinearLoop loop(controller, geometry, plant);
  Certificate certificate{};
  certificate.period = loop.period();
  certificate.belief_spectral_radius = loop.beliefSpectralRadius();
  certificate.loop_spectral_radius = loop.worstSpectralRadius();
  certificate.radius_uncertainty = loop.radiusUncertainty();
  certificate.straight = certifyMode(loop, LoopMode::straight);
  certificate.turn = certifyMode(loop, LoopMode::turn);
  certificate.gain_margin = std::min(certificate.straight.gain_margin, certificate.turn.gain_margin);
  certificate.delay_margin = std::min(certificate.straight.delay_margin, certificate.turn.delay_margin);
  return certificate;
}

std::vector<Sensitivity> sensitivities(const ControllerParameters& controller, const GeometryParameters& geometry,
                                       const PlantModel& plant) {
  constexpr double kStep = 0.01;
  const bool belief = LinearLoop(controller, geometry, plant).beliefSpectralRadius() >= kStabilityLimit;
  const auto log_radius = [&](const std::string& parameter, double factor) {
    const LinearLoop loop(scaled(controller, parameter, factor), geometry, plant);
    return std::log(belief ? loop.beliefSpectralRadius() : loop.worstSpectralRadius());
  };
  std::vector<Sensitivity> list;
  for (const char* parameter : {"kappa_a", "tau", "kappa_mu", "state_variances", "sensory_variances"}) {
    const double difference = log_radius(parameter, 1.0 + kStep) - log_radius(parameter, 1.0 - kStep);
    list.push_back({parameter, difference / std::log((1.0 + kStep) / (1.0 - kStep))});
  }
  std::stable_sort(list.begin(), list.end(),
                   [](const auto& a, const auto& b) { return std::abs(a.value) > std::abs(b.value); });
  return list;
}

Bounds gainBounds(Gain gain) {
  BoundsOf visitor(kGainNames[static_cast<std::size_t>(gain)]);
  ControllerParameters any;
  describeFields(visitor, any);
  return visitor.bounds();
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

std::string advice(const Certificate& certificate, const ControllerParameters& controller,
                   const GeometryParameters& geometry, const PlantModel& plant, const MarginBounds& bounds) {
  if (!certificate.stable()) {
    return "Unstable: " + instability(LinearLoop(controller, geometry, plant)) + "; " +
           blame(controller, geometry, plant) + ".";
  }
  const std::string room = "kappa_a may rise by a factor of " +
                           atLeast(certificate.gain_margin, kLargestGainMargin, "") + " or the dead time by " +
                           atLeast(certificate.delay_margin, kLargestDelayMargin, " s") + " before the loop oscillates";
  if (certificate.keeps(bounds)) {
    return "Stable with room: " + room + ".";
  }
  return "Stable, but with a thin margin (below " + text(bounds.gain) + " or " + text(bounds.delay) + " s): " + room +
         "; lower kappa_a = " + text(controller.kappa_a) + ".";
}

void requireStable(const ControllerParameters& controller, const GeometryParameters& geometry,
                   const PlantModel& plant) {
  const LinearLoop loop(controller, geometry, plant);
  if (isStable(loop)) return;
  throw ParameterError("controller: " + instability(loop) + "; " + blame(controller, geometry, plant));
}

}  // namespace jackal_aic
