#include "jackal_aic/faults/sliding_range.hpp"

#include <algorithm>
#include <functional>

namespace jackal_aic {

SlidingRange::SlidingRange(std::size_t youngest, std::size_t oldest, std::size_t kept)
    : youngest_(static_cast<Time>(youngest)), oldest_(static_cast<Time>(oldest)) {
  while (mask_ < oldest_ + kept + 1) mask_ = 2 * mask_ + 1;  // the one that leaves included
  values_.resize(mask_ + 1);
  smallest_.times.resize(mask_ + 1);
  largest_.times.resize(mask_ + 1);
  fill(0.0);
}

void SlidingRange::fill(double value) {
  std::fill(values_.begin(), values_.end(), value);
  low_ = high_ = value;
  for (Queue* queue : {&smallest_, &largest_}) {
    queue->begin = 0;
    queue->end = 1;
  }
}

void SlidingRange::add(double value, std::size_t number, double* lows, double* highs) {
  double entered = valueAt(now_ - youngest_), left = valueAt(now_ - oldest_);
  Time now = now_;
  for (std::size_t i = 0; i < number; ++i) {
    values_[++now & mask_] = value;
    const double entering = valueAt(now - youngest_), leaving = valueAt(now - oldest_);
    if (entering != entered) enter(now - youngest_);
    if (leaving != left) leave(now - oldest_ - 1);
    entered = entering;
    left = leaving;
    lows[i] = low_;
    highs[i] = high_;
  }
  now_ = now;
}

template <class Beats>
void SlidingRange::push(Queue& queue, Time entering, Beats beats) {
  last(queue) = entering - 1;  // the run before has ended
  while (queue.begin != queue.end && !beats(valueAt(last(queue)), valueAt(entering))) --queue.end;
  ++queue.end;
  last(queue) = entering;
}

void SlidingRange::enter(Time entering) {
  push(smallest_, entering, std::less<>());
  push(largest_, entering, std::greater<>());
  low_ = valueAt(first(smallest_));
  high_ = valueAt(first(largest_));
}

void SlidingRange::leave(Time leaving) {
  if (first(smallest_) == leaving) ++smallest_.begin;
  if (first(largest_) == leaving) ++largest_.begin;
  low_ = valueAt(first(smallest_));
  high_ = valueAt(first(largest_));
}

}  // namespace jackal_aic
