#pragma once

/// @file
/// Smallest and largest of the last values of a signal, at a cost that does not depend on how many these are.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace jackal_aic {

/// Range of the values whose age is from `youngest` to `oldest` steps.
///
/// By two monotone queues: what is neither smaller than a later value nor will outlast it can never be the smallest
/// again, and leaves the queue of the smallest when that one enters. So the first of a queue is the extreme, and every
/// value enters and leaves once. Nothing here allocates.
/// @tparam largest_age bound of `oldest`; only the memory of those in use is touched.
template <std::size_t largest_age>
class SlidingRange {
  static_assert(largest_age < 65536, "times are kept in 16 bits");

 public:
  /// All values are 0. @param youngest, oldest ages [steps], youngest <= oldest <= largest_age.
  SlidingRange(std::size_t youngest, std::size_t oldest)
      : youngest_(static_cast<Time>(youngest)), oldest_(static_cast<Time>(oldest)) {
    while (mask_ < oldest) mask_ = 2 * mask_ + 1;
    fill(0.0);
  }

  /// As if the value had been this one for long.
  void fill(double value) {
    std::fill_n(values_.begin(), mask_ + 1, value);
    smallest_.begin = largest_.begin = smallest_.end = largest_.end = 0;
    push(smallest_, now_ - youngest_);
    push(largest_, now_ - youngest_);
  }

  /// Adds a value, of age 0; the others age by a step.
  void add(double value) {
    values_[++now_ & mask_] = value;
    const Time entering = now_ - youngest_, leaving = now_ - oldest_ - 1;
    const double entered = values_[entering & mask_];
    if (first(smallest_) == leaving) ++smallest_.begin;
    if (first(largest_) == leaving) ++largest_.begin;
    while (smallest_.begin != smallest_.end && last(smallest_) >= entered) --smallest_.end;
    while (largest_.begin != largest_.end && last(largest_) <= entered) --largest_.end;
    push(smallest_, entering);
    push(largest_, entering);
  }

  /// The value of an age, at most `oldest`.
  double at(std::size_t age) const { return values_[static_cast<Time>(now_ - age) & mask_]; }

  double newest() const { return values_[now_ & mask_]; }           ///< the last value added
  double oldest() const { return at(oldest_); }                     ///< the value of age `oldest`
  double low() const { return values_[first(smallest_) & mask_]; }  ///< smallest value
  double high() const { return values_[first(largest_) & mask_]; }  ///< largest value

 private:
  using Time = std::uint16_t;  // [steps], wraps around

  static constexpr std::size_t ringSize() {
    std::size_t size = 1;
    while (size <= largest_age) size *= 2;
    return size;
  }
  template <class Element>
  using Ring = std::array<Element, ringSize()>;  // of which mask_ + 1 elements are in use, a power of two

  /// Times of values, the earliest first, of which each is beaten by none that is later.
  struct Queue {
    Ring<Time> times{};
    Time begin = 0, end = 0;
  };

  Time first(const Queue& queue) const { return queue.times[queue.begin & mask_]; }
  double last(const Queue& queue) const {
    return values_[queue.times[static_cast<Time>(queue.end - 1) & mask_] & mask_];
  }
  void push(Queue& queue, Time time) { queue.times[queue.end++ & mask_] = time; }

  Time youngest_, oldest_;
  std::size_t mask_ = 0;
  Time now_ = 0;
  Ring<double> values_{};
  Queue smallest_, largest_;
};

}  // namespace jackal_aic
