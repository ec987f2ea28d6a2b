#pragma once

/// @file
/// Smallest and largest of the last values of a signal, at a cost that does not depend on how many these are.

#include <cstddef>
#include <cstdint>
#include <vector>

namespace jackal_aic {

/// Range of the values whose age is from `youngest` to `oldest` steps, of a signal that stays for some steps, as a
/// command does from one action to the next.
///
/// By two monotone queues: what is neither smaller than a later value nor will outlast it can never be the smallest
/// again, and leaves the queue of the smallest when that one enters. So the first of a queue is the extreme, and every
/// value enters and leaves once. Where the value that enters is the one before, and so is the one that leaves, nothing
/// changes. Allocates when it is made, and not after.
class SlidingRange {
 public:
  /// All values are 0. @param youngest, oldest ages [steps], youngest <= oldest; @param kept for how much longer values
  /// can be told [steps].
  SlidingRange(std::size_t youngest, std::size_t oldest, std::size_t kept = 0);

  /// As if the value had been this one for long.
  void fill(double value);

  /// Adds a value, of age 0; the others age by a step.
  void add(double value) {
    double low, high;
    add(value, 1, &low, &high);
  }

  /// Adds a value a number of times. @param[out] lows, highs smallest and largest value after each.
  void add(double value, std::size_t number, double* lows, double* highs);

  /// The value of an age, at most `oldest` and what is kept.
  double at(std::size_t age) const { return valueAt(now_ - static_cast<Time>(age)); }

  double low() const { return low_; }    ///< smallest value
  double high() const { return high_; }  ///< largest value

 private:
  using Time = std::uint32_t;  // [steps], wraps around

  /// Runs of equal values by the time of their last one, the earliest first, of which each is beaten by none that is
  /// later. The last run is the one that has entered last: it may go on, and its time is that of its first value.
  struct Queue {
    std::vector<Time> times;
    Time begin = 0, end = 0;
  };

  double valueAt(Time time) const { return values_[time & mask_]; }
  Time first(const Queue& queue) const { return queue.times[queue.begin & mask_]; }
  Time& last(Queue& queue) { return queue.times[(queue.end - 1) & mask_]; }
  template <class Beats>
  void push(Queue& queue, Time entering, Beats beats);
  void enter(Time entering);
  void leave(Time leaving);

  Time youngest_, oldest_;
  Time mask_ = 0;  // the rings have mask_ + 1 elements, a power of two
  Time now_ = 0;
  std::vector<double> values_;
  Queue smallest_, largest_;
  double low_ = 0.0, high_ = 0.0;
};

}  // namespace jackal_aic
