#include "margin_search.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <vector>

#include "jackal_aic/certificate/boundary.hpp"
#include "periodic_system.hpp"
#include "return_difference.hpp"

namespace jackal_aic {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSmallestGainFactor = 1e-3;
constexpr double kWidth = 1e-6;   // of a boundary that was foretold, to either side, relative
constexpr double kExact = 2e-9;   // s, more than a delay is rounded by
constexpr int kMostSecants = 10;  // to such a delay; three suffice
constexpr double kStep = 0.01;    // of a parameter, relative, for its sensitivity

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

/// Where the return difference of a stable loop foretells its margins.
class Forecast {
 public:
  explicit Forecast(const SearchedLoop& loop) : loop_(loop) {}

  /// For the worst phase; empty if they cannot be foretold.
  std::optional<Margins> margins() {
    if (!loop_.foretellable) return std::nullopt;
    const double longest = loop_.longest_phase;
    Margins margins;
    margins.gain_margin = smallestOverPhase([&](double phase) { return moreGain(phase); }, longest);
    margins.gain_reduction = 1.0 / smallestOverPhase([&](double phase) { return lessGain(phase); }, longest);
    margins.delay_margin = smallestOverPhase([&](double phase) { return moreDelay(phase); }, longest);
    margins.delay_margin = std::min(margins.delay_margin, shortestUnstableDelay());
    return known_ ? std::optional(margins) : std::nullopt;
  }

 private:
  ReturnDifference differenceAt(double extra_dead_time, double phase) {
    ReturnDifference difference(loop_.map({0.0, extra_dead_time, phase}), loop_.map({1.0, extra_dead_time, phase}));
    known_ = known_ && difference.known();
    return difference;
  }

  const std::vector<double>& criticalGains(double phase) {
    const auto [entry, is_new] = gains_.try_emplace(phase);
    if (is_new) entry->second = differenceAt(0.0, phase).criticalGains();
    return entry->second;
  }

  /// Smallest factor above 1, of those that are searched.
  double moreGain(double phase) {
    double smallest = kInfinity;
    for (const double gain : criticalGains(phase)) {
      if (gain > 1.0 && gain < kLargestGainMargin) smallest = std::min(smallest, gain);
    }
    return smallest;
  }

  /// Smallest divisor above 1, likewise.
  double lessGain(double phase) {
    double smallest = kInfinity;
    for (const double gain : criticalGains(phase)) {
      if (gain < 1.0 && gain > kSmallestGainFactor) smallest = std::min(smallest, 1.0 / gain);
    }
    return smallest;
  }

  /// By how much the critical delay is longer than `extra`. It is right where that is 0, as it is taken for whole
  /// periods beside what is left of `extra`, which is part of the map.
  double excess(double extra, double phase) {
    const double period = loop_.period, rest = std::fmod(extra, period);
    return rest + period * differenceAt(rest, phase).criticalDelay(-rest / period) - extra;
  }

  /// The zero of excess() by secants, from what the phase before this had: an older sample is as good as a late
  /// command.
  double moreDelay(double phase) {
    delay_ = std::max(0.0, delay_ + phase_ - phase);
    phase_ = phase;
    double here = excess(delay_, phase), slope = -1.0;
    for (int i = 0; i < kMostSecants && std::isfinite(here); ++i) {
      const double step = std::max(-here / slope, -delay_);
      delay_ += step;
      if (std::abs(step) < kWidth * delay_) return delay_;
      const double before = here;
      here = excess(delay_, phase);
      if (here != before) slope = (here - before) / step;
    }
    return std::isfinite(here) ? delay_ : kInfinity;
  }

  /// On a grid of phases and of what delays have beside whole periods, as dense as the strides of a walk: a loop may be
  /// unstable with some delays and stable again with longer ones.
  double shortestUnstableDelay() {
    constexpr int kPhases = 3, kParts = 4;
    double shortest = kInfinity;
    for (int i = 0; i < kPhases * kParts; ++i) {
      const double phase = loop_.longest_phase * (i % kPhases) / (kPhases - 1);
      const double rest = loop_.period * (i / kPhases) / kParts;
      const double critical = differenceAt(rest, phase).criticalDelay(-rest / loop_.period);
      shortest = std::min(shortest, rest + loop_.period * std::ceil(critical));
    }
    return shortest;
  }

  const SearchedLoop& loop_;
  bool known_ = true;
  std::map<double, std::vector<double>> gains_;  // by phase
  double delay_ = 0.0, phase_ = 0.0;             // of the last search for a delay
};

/// The last point before a boundary that was foretold, if the verdict changes there; `none` if it is beyond `end` and
/// the verdict holds there. @param width of the boundary to either side, with the sign of the way to `end`.
std::optional<double> confirmed(const LineTest& holds, double foretold, double width, double end, double none) {
  const double before = foretold - width, after = foretold + width;
  const bool beyond = width > 0.0 ? !(after < end) : !(after > end);
  if (beyond) return holds(end) ? std::optional(none) : std::nullopt;
  return holds(before) && !holds(after) ? std::optional(before) : std::nullopt;
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

Margins findMargins(const SearchedLoop& loop) {
  const LoopTest& stable = loop.stable;
  Margins margins;
  if (!loop.is_stable) {
    margins.gain_margin = margins.gain_reduction = gainBoundary(stable, kSmallestGainFactor, 0.0);
    margins.delay_margin = delayBoundary(stable, loop.action_period, -loop.dead_time);
    return margins;
  }
  const double longest = largestDelayMargin(loop.action_period);
  std::optional<double> less_gain, more_gain, more_delay;
  if (const auto foretold = Forecast(loop).margins()) {
    const LineTest at_gain = [&](double factor) { return stable({factor, 0.0}); };
    const LineTest at_delay = [&](double extra) { return stable({1.0, extra}); };
    const auto [gain, reduction, delay] = *foretold;
    less_gain = confirmed(at_gain, reduction, -kWidth * reduction, kSmallestGainFactor, 0.0);
    more_gain = confirmed(at_gain, gain, kWidth * gain, kLargestGainMargin, kLargestGainMargin);
    more_delay = confirmed(at_delay, delay, kWidth * delay + kExact, longest, longest);
  }
  margins.gain_reduction = less_gain ? *less_gain : gainBoundary(stable, kSmallestGainFactor, 0.0);
  margins.gain_margin = more_gain ? *more_gain : gainBoundary(stable, kLargestGainMargin, kLargestGainMargin);
  margins.delay_margin = more_delay ? *more_delay : delayBoundary(stable, loop.action_period, longest);
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
