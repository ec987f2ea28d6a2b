#pragma once

/// @file
/// Decides in which simulation steps a periodic event occurs.

#include <cstdint>

namespace jackal_aic::sim {

/// A rate that need not divide the rate of the steps: event k = 0, 1, ... is due in the first step that is not earlier
/// than k / rate, so that rounding to steps never accumulates.
class Periodic {
 public:
  /// @param rate [Hz].
  explicit Periodic(double rate) : rate_(rate) {}

  /// True if an event is due at this time [s]; to be asked once per step, from time 0.
  bool due(double time) {
    // Slack for the rounding of time, far below a step.
    if (time + 1e-9 < static_cast<double>(events_) / rate_) return false;
    ++events_;
    return true;
  }

 private:
  double rate_;
  std::int64_t events_ = 0;
};

}  // namespace jackal_aic::sim
