#pragma once

/// @file
/// How often a healthy sensor repeats its value.

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "jackal_aic/faults/density.hpp"

namespace jackal_aic::faults {

/// Chance that a healthy sensor repeats its value once more, by how often it has done so: a renewal process with a
/// Beta-Bernoulli belief for each length of the run (0, 1, 2, 4, 8, ...). Coarse sensors, sources that hold a value and
/// messages that are published twice are the same thing here.
class Repetition {
 public:
  /// Each has a belief of its own.
  enum Kind {
    rest,      ///< nothing moves; noise at rest may be another one
    moving,    ///< the robot moves
    under_way  ///< what is measured has left the value: only a source that holds its values repeats it
  };

  bool repeats(double value) const { return any_ && value == last_; }  ///< the value is that of the last sample

  /// ln of the chance of what a sample does: repeat the value, or change it. @param noise variance of the sensor's
  /// noise: where it is small beside the resolution, repetitions depend on each other.
  double logChance(double value, Kind kind, double noise) const {
    const Count& first = counts_[kind][0];
    const double alike = noise / std::max(square(resolution_), kTiny);
    const double beforehand = kind == under_way ? kHolds : 0.5;
    const double weight = kind == under_way ? kHoldsKnown : 1.0;
    const double known =
        kind == under_way ? kHoldsKnown : std::clamp(std::min(kAlike * alike, first.changes), 1.0, kAlike);
    const double chance = bucket() == 0 ? first.chance(beforehand, weight)
                                        : counts_[kind][bucket()].chance(first.chance(beforehand, weight), known);
    return std::log(repeats(value) ? chance : 1.0 - chance);
  }

  /// Takes a value whose repetition says nothing.
  void pass(double value) {
    last_ = value;
    any_ = true;
    run_ = 0;
  }

  /// Learns. @param explained change that the motion explains: noise goes to and fro by more; @param healthy
  /// probability that the sample was healthy. A run counts as a healthy one when it ends.
  void update(double value, double explained, Kind kind, double healthy) {
    const double change = any_ ? value - last_ : 0.0;
    Count& count = counts_[kind][bucket()];
    if (any_ && std::abs(change) < kSmallest) {
      count.repeats += healthy;
      count.doubtful += 1.0 - healthy;
      ++run_;
    } else if (any_) {
      const bool noisy = change * change_ < 0.0 && std::abs(change) > 2.0 * explained;
      if (kind == under_way || noisy) count.changes += (kind == under_way ? 1.0 : 1.5) * healthy;
      for (auto& counts : counts_)
        for (Count& each : counts) each.repeats += healthy * std::exchange(each.doubtful, 0.0);
      change_ = change;
      run_ = 0;
      resolution_ = resolution_ == 0.0 ? std::abs(change) : std::min(resolution_, std::abs(change));
    }
    if (count.repeats + count.changes > kMemory) {
      count.repeats *= 0.5;
      count.changes *= 0.5;
    }
    last_ = value;
    any_ = true;
  }

 private:
  static constexpr int kBuckets = 8;
  static constexpr double kSmallest = 1e-6;    // smaller changes are no noise [rad/s, m/s^2]
  static constexpr double kHolds = 0.05;       // chance that a source holds a value that it should have left
  static constexpr double kHoldsKnown = 10.0;  // samples for which that is known beforehand
  static constexpr double kAlike = 20.0;       // samples for which longer runs are known by the first repetition
  static constexpr double kMemory = 3000.0;    // samples, a minute at 50 Hz
  static constexpr double kTiny = 1e-20;

  struct Count {
    double repeats = 0.0, changes = 0.0, doubtful = 0.0;
    double chance(double beforehand, double weight) const {
      return (repeats + weight * beforehand) / (repeats + changes + weight);
    }
  };
  int bucket() const {
    int b = 0;
    for (int run = run_; run > 0 && b + 1 < kBuckets; run >>= 1) ++b;
    return b;
  }

  std::array<std::array<Count, kBuckets>, 3> counts_{};
  double last_ = 0.0, change_ = 0.0, resolution_ = 0.0;
  int run_ = 0;
  bool any_ = false;
};

}  // namespace jackal_aic::faults
