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

  int run() const { return run_; }  ///< number of repetitions so far

  /// Smallest change so far; 0 before there were some.
  double resolution() const { return all_ < kFewChanges ? 0.0 : resolution_; }

  /// ln of the chance of what a sample does: repeat the value, or change it.
  double logChance(double value, Kind kind) const {
    const bool holds = kind == under_way;
    const double first = counts_[kind][0].chance(holds ? kHolds : 0.5, holds ? kHoldsKnown : 1.0);
    const int longer = bucket();
    const double other = longer == 0 ? first : counts_[kind][longer].chance(first, kAlike);
    // Where in a coarse step a value lies decides how often it repeats, and is the same for the whole run. Of noise s
    // and steps q that makes a difference of e^(-2 pi^2 (s/q)^2), the first harmonic of the rounding error. Changes to
    // and fro have a mean square of 2 s^2, or of q^2 if s is small.
    constexpr double kHarmonic = 19.74;  // 2 pi^2
    const double known = holds ? kMemory : std::clamp(std::exp(kHarmonic * steps()), 1.0, 1.0 + kPerChange * all_);
    const double chance = (known * other + run_) / (known + run_);
    return std::log(repeats(value) ? chance : 1.0 - chance);
  }

  /// Probability that a value was held by its source and not measured again; 0 of one that does not repeat.
  double held(double value) const {
    if (!repeats(value)) return 0.0;
    const double holds = counts_[under_way][0].chance(kHolds, kHoldsKnown);
    const double same = std::min(1.0, 0.28 / std::sqrt(std::max(steps(), kTiny)));  // q/(2 sqrt(pi) s), of noise
    return holds / (holds + (1.0 - holds) * same);
  }

  /// Takes a value whose repetition says nothing.
  void pass(double value) {
    last_ = value;
    any_ = true;
    run_ = 0;
  }

  /// Learns. @param explained change that the motion explains: noise goes to and fro by more; @param healthy
  /// probability that the sample was healthy; @param stands nothing may move: then only a run that noise ends counts.
  /// A run enters the counts when it ends, so that none makes itself usual.
  void update(double value, double explained, Kind kind, double healthy, bool stands = false) {
    const double change = any_ ? value - last_ : 0.0;
    Count& count = counts_[kind][bucket()];
    if (any_ && std::abs(change) < kSmallest) {
      (stands ? count.standing : count.running) += 1.0;
      ++run_;
    } else if (any_) {
      const bool noisy = change * change_ < 0.0 && std::abs(change) > 2.0 * explained;
      if (noisy) {
        flips_ = std::min(flips_ + 1.0, kFlips);
        flip_ += (square(change) - flip_) / flips_;
      }
      if (kind == under_way || noisy) count.changes += (kind == under_way ? 1.0 : 1.5) * healthy;
      for (auto& counts : counts_)
        for (Count& each : counts) {
          each.repeats += healthy * (std::exchange(each.running, 0.0) + (noisy ? each.standing : 0.0));
          each.standing = 0.0;
        }
      change_ = change;
      run_ = 0;
      all_ = std::min(all_ + 1.0, kMemory);
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
  static constexpr double kFewChanges = 10.0;
  static constexpr double kSmallest = 1e-6;    // smaller changes are no noise [rad/s, m/s^2]
  static constexpr double kHolds = 0.05;       // chance that a source holds a value that it should have left
  static constexpr double kHoldsKnown = 10.0;  // samples for which that is known beforehand
  static constexpr double kAlike = 20.0;       // samples for which longer runs are known by the first repetition
  static constexpr double kMemory = 3000.0;    // samples, a minute at 50 Hz
  static constexpr double kFlips = 100.0;      // changes to and fro over which their size is averaged
  static constexpr double kFewFlips = 5.0;     // of which nothing is known yet
  static constexpr double kPerChange = 3.0;

  struct Count {
    double repeats = 0.0, changes = 0.0, running = 0.0, standing = 0.0;
    double chance(double beforehand, double weight) const {
      return (repeats + weight * beforehand) / (repeats + changes + weight);
    }
  };
  double steps() const { return flips_ < kFewFlips ? 0.0 : 0.5 * (flip_ / square(resolution_) - 1.0); }  // (s/q)^2
  int bucket() const {
    int b = 0;
    for (int run = run_; run > 0 && b + 1 < kBuckets; run >>= 1) ++b;
    return b;
  }

  std::array<std::array<Count, kBuckets>, 3> counts_{};
  double last_ = 0.0, change_ = 0.0, resolution_ = 0.0;
  double all_ = 0.0;                 // changes, up to kMemory
  double flip_ = 0.0, flips_ = 0.0;  // mean square of the changes to and fro, and their number
  int run_ = 0;
  bool any_ = false;
};

}  // namespace jackal_aic::faults
