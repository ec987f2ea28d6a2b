#pragma once

/// @file
/// Smallest and largest of the last values of a signal that changes with every step and is looked at now and then.

#include <algorithm>
#include <cstddef>
#include <vector>

namespace jackal_aic {

/// Range of the values whose age is at most `oldest` steps. A value that is added costs little: it goes into a ring and
/// into the extremes of its block of the ring. Whoever asks pays for looking at the blocks, and at the values of the
/// one that is partly too old. Allocates when it is made, and not after.
class RecentRange {
 public:
  /// Smallest and largest value.
  struct Range {
    double low;   ///< smallest
    double high;  ///< largest
  };

  /// All values are 0. @param oldest age [steps].
  explicit RecentRange(std::size_t oldest);

  /// As if the value had been this one for long.
  void fill(double value);

  /// Adds a value, of age 0; the others age by a step.
  void add(double value) {
    now_ = (now_ + 1) & mask_;
    values_[now_] = value;
    Range& block = blocks_[now_ / kBlock];
    block = now_ % kBlock == 0 ? Range{value, value} : Range{std::min(block.low, value), std::max(block.high, value)};
    looked_ = false;
  }

  double newest() const { return values_[now_]; }                      ///< the last value added
  double oldest() const { return values_[(now_ - oldest_) & mask_]; }  ///< the value of age `oldest`
  Range range() const;                                                 ///< of all values in between

 private:
  void look() const;

  static constexpr std::size_t kBlock = 16;  // values

  std::size_t oldest_;
  std::size_t mask_ = kBlock - 1;  // the ring has mask_ + 1 elements, a power of two
  std::size_t now_ = 0;
  std::vector<double> values_;
  std::vector<Range> blocks_;  // of the ring; that of the newest value has no older ones
  mutable bool looked_ = false;
  mutable Range range_{};  // as it was looked at since the last value was added
};

}  // namespace jackal_aic
