#include "stop_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace jackal_aic::sim {
namespace {

constexpr double kSteadyTime = 1.0;      // s before the stop and before the end
constexpr double kSettledWithin = 0.05;  // of the set point

/// Root mean square of a wheel's command about its mean between two times.
double rippleBetween(const std::vector<Sample>& samples, double from, double until) {
  WheelVector sum = WheelVector::Zero(), squares = WheelVector::Zero();
  double count = 0.0;
  for (const Sample& s : samples) {
    if (s.time < from || s.time >= until) continue;
    sum += s.command.vector();
    squares += s.command.vector().cwiseAbs2();
    ++count;
  }
  return std::sqrt(std::max(0.0, (squares / count - (sum / count).cwiseAbs2()).maxCoeff()));
}

/// Mean of a channel before the stop.
double finalValue(const std::vector<Sample>& samples, double stop, double Sample::*channel) {
  double sum = 0.0, count = 0.0;
  for (const Sample& s : samples) {
    if (s.time < stop - kSteadyTime || s.time >= stop) continue;
    sum += s.*channel;
    ++count;
  }
  return sum / count;
}

/// Adds the figures of one channel. @param beyond figure of what is beyond zero.
void assess(const std::vector<Sample>& samples, double stop, double set_point, double Sample::*channel,
            StopFigures& figures, double& beyond) {
  if (set_point == 0.0) return;
  const double end = finalValue(samples, stop, channel);
  const double level = std::max(1.0, end / set_point);
  double settled = kRestTime;
  for (const Sample& s : samples) {
    const double along = s.*channel / set_point;
    if (s.time > stop) {
      beyond = std::max(beyond, -along * std::abs(set_point));
      continue;
    }
    figures.overshoot_pct = std::max(figures.overshoot_pct, 100.0 * (along - level));
    figures.excess_pct = std::max(figures.excess_pct, 100.0 * (along - 1.0));
    if (std::abs(s.*channel - end) > kSettledWithin * std::abs(set_point)) settled = s.time;
  }
  const bool settles = settled < stop - kSteadyTime && figures.settling;
  figures.settling = settles ? std::optional(std::max(*figures.settling, settled - kRestTime)) : std::nullopt;
}

}  // namespace

void StopFigures::worsen(const StopFigures& other) {
  settling = settling && other.settling ? std::optional(std::max(*settling, *other.settling)) : std::nullopt;
  overshoot_pct = std::max(overshoot_pct, other.overshoot_pct);
  excess_pct = std::max(excess_pct, other.excess_pct);
  beyond_mps = std::max(beyond_mps, other.beyond_mps);
  beyond_radps = std::max(beyond_radps, other.beyond_radps);
  ripple = std::max(ripple, other.ripple);
}

bool StopBars::keepStop(const StopFigures& figures) const {
  return figures.beyond_mps <= beyond_mps && figures.beyond_radps <= beyond_radps;
}

std::string StopBars::missed(const StopFigures& figures) const {
  if (!figures.settling) return "never settles";
  if (!(figures.overshoot_pct <= overshoot_pct))
    return fmt::format("overshoots by {:.4g} % (at most {:.4g})", figures.overshoot_pct, overshoot_pct);
  if (!(figures.beyond_mps <= beyond_mps))
    return fmt::format("runs back with {:.4g} m/s after the stop", figures.beyond_mps);
  if (!(figures.beyond_radps <= beyond_radps))
    return fmt::format("turns back with {:.4g} rad/s after the stop", figures.beyond_radps);
  if (!(figures.ripple <= ripple)) return fmt::format("its command ripples by {:.4g} rad/s", figures.ripple);
  return "";
}

SetPointProfile stopProfile(const SetPoint& set_point, double drive, double stand) {
  SetPointProfile profile;
  profile.changes = {{kRestTime, set_point}, {kRestTime + drive, SetPoint{}}};
  profile.duration = kRestTime + drive + stand;
  profile.assessed.reset();
  return profile;
}

StopFigures assessStop(const std::vector<Sample>& samples, const SetPoint& set_point, double drive) {
  const double stop = kRestTime + drive - 0.5 * JackalPlant::kStep, end = samples.back().time;
  StopFigures figures;
  assess(samples, stop, set_point.forward, &Sample::velocity, figures, figures.beyond_mps);
  assess(samples, stop, set_point.yaw_rate, &Sample::yaw_rate, figures, figures.beyond_radps);
  figures.ripple =
      std::max(rippleBetween(samples, stop - kSteadyTime, stop), rippleBetween(samples, end - kSteadyTime, end));
  return figures;
}

}  // namespace jackal_aic::sim
