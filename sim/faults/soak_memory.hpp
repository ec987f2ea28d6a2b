#pragma once

/// @file
/// How the memory of a process grows over a soak. Pure.

#include <algorithm>

namespace jackal_aic::sim {

/// Follows the resident memory of a process. What it grows by is told after the warm-up, the first tenth of the time; a
/// soak whose first look comes later begins there.
class SoakMemory {
 public:
  /// @param duration of the soak [s].
  explicit SoakMemory(double duration) : warm_up_(0.1 * duration) {}

  /// Takes the memory at a time [s] of the soak.
  void add(double time, double memory) {
    if (time < warm_up_ || !begun_) warm_ = largest_ = memory;
    begun_ = true;
    largest_ = std::max(largest_, memory);
  }

  /// Largest growth since the end of the warm-up, in the unit of the memory.
  double growth() const { return largest_ - warm_; }

 private:
  double warm_up_;        // [s]
  double warm_ = 0.0;     // at its end
  double largest_ = 0.0;  // since then
  bool begun_ = false;
};

}  // namespace jackal_aic::sim
