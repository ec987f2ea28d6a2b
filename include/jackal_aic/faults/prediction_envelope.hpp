#pragma once

/// @file
/// Interval of a prediction whose delay is uncertain.

#include <cstddef>

#include "jackal_aic/faults/recent_range.hpp"

namespace jackal_aic {

/// Interval of a predicted quantity that may come up to `behind` later or `ahead` earlier than predicted. A second
/// prediction runs `ahead` steps ahead. Allocates in the constructor only.
class PredictionEnvelope {
 public:
  /// Longest uncertainty [steps].
  static constexpr std::size_t kLongest = 600;

  /// @param behind, ahead uncertainty [steps], each at most kLongest.
  PredictionEnvelope(std::size_t behind, std::size_t ahead);

  /// Starts with constant predictions.
  void start(double now, double ahead);

  /// Adds a step. @param now the prediction; @param ahead the one that runs `ahead` steps ahead of it. Only changes of
  /// the latter count.
  void add(double now, double ahead) { add(&now, &ahead, 1); }

  /// The same for a number of steps.
  void add(const double* now, const double* ahead, std::size_t number) {
    now_.add(now, number);
    later_.add(ahead, number);
    looked_ = false;
  }

  /// Smallest and largest value inside.
  const RecentRange::Range& range() const {
    if (!looked_) look();
    return range_;
  }

 private:
  void look() const;

  RecentRange now_;    // the last predictions
  RecentRange later_;  // those that run ahead
  mutable bool looked_ = false;
  mutable RecentRange::Range range_{};  // as it was looked at since the last step
};

}  // namespace jackal_aic
