#pragma once

/// @file
/// Smallest and largest of the last values of a signal that changes with every step and is looked at now and then.

#include <cstddef>
#include <vector>

namespace jackal_aic {

/// Range of the values whose age is at most `oldest` steps. Adding a value costs one write into a ring, a query reads
/// all values. Allocates in the constructor only.
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
  void add(double value) { add(&value, 1); }

  /// Adds values, the last one of age 0.
  void add(const double* values, std::size_t number);

  double newest() const { return values_[now_]; }                      ///< the last value added
  double oldest() const { return values_[(now_ - oldest_) & mask_]; }  ///< the value of age `oldest`
  Range range() const;                                                 ///< of all values in between

 private:
  Range rangeOf(std::size_t begin, std::size_t end) const;

  std::size_t oldest_;
  std::size_t mask_ = 0;  // the ring has mask_ + 1 elements, a power of two
  std::size_t now_ = 0;
  std::vector<double> values_;
};

}  // namespace jackal_aic
