#pragma once

/// @file
/// The last values of a signal.

#include <algorithm>
#include <cstddef>
#include <vector>

#include "jackal_aic/model/robot_range.hpp"

namespace jackal_aic {

/// Ring of the last values of a signal, one per step. Allocates in the constructor only.
class RecentValues {
 public:
  /// All values are 0. @param oldest age that is kept [steps].
  explicit RecentValues(std::size_t oldest) : values_(oldest + 1) {}

  /// As if the value had been this one for long.
  void fill(double value) { std::fill(values_.begin(), values_.end(), value); }

  /// Adds a value, of age 0; the others age by a step.
  void add(double value) {
    newest_ = newest_ + 1 == values_.size() ? 0 : newest_ + 1;
    values_[newest_] = value;
  }

  /// The value of an age, at most the oldest.
  double at(std::size_t age) const { return values_[newest_ >= age ? newest_ - age : newest_ + values_.size() - age]; }

  /// Smallest and largest value from one age to another.
  Range range(std::size_t youngest, std::size_t oldest) const {
    Range range{at(youngest), at(youngest)};
    for (std::size_t age = youngest + 1; age <= oldest; ++age) {
      range = {std::min(range.low, at(age)), std::max(range.high, at(age))};
    }
    return range;
  }

 private:
  std::vector<double> values_;
  std::size_t newest_ = 0;
};

}  // namespace jackal_aic
