#include "jackal_aic/faults/recent_range.hpp"

#include <Eigen/Core>
#include <algorithm>

namespace jackal_aic {

RecentRange::RecentRange(std::size_t oldest) : oldest_(oldest) {
  while (mask_ < oldest) mask_ = 2 * mask_ + 1;
  values_.resize(mask_ + 1);
  fill(0.0);
}

void RecentRange::fill(double value) { std::fill(values_.begin(), values_.end(), value); }

void RecentRange::add(const double* values, std::size_t number) {
  for (std::size_t i = 0; i < number; ++i) values_[++now_ & mask_] = values[i];
  now_ &= mask_;
}

/// Eight at a time: each comparison waits for the one before.
RecentRange::Range RecentRange::rangeOf(std::size_t begin, std::size_t end) const {
  using Eight = Eigen::Array<double, 8, 1>;
  Eight low = Eight::Constant(values_[begin]), high = low;
  for (; begin + 8 <= end; begin += 8) {
    const Eigen::Map<const Eight> next(&values_[begin]);
    low = low.min(next);
    high = high.max(next);
  }
  Range range{low.minCoeff(), high.maxCoeff()};
  for (; begin < end; ++begin) range = {std::min(values_[begin], range.low), std::max(values_[begin], range.high)};
  return range;
}

RecentRange::Range RecentRange::range() const {
  const std::size_t first = (now_ - oldest_) & mask_;
  if (first <= now_) return rangeOf(first, now_ + 1);
  const Range older = rangeOf(first, values_.size()), newer = rangeOf(0, now_ + 1);
  return {std::min(older.low, newer.low), std::max(older.high, newer.high)};
}

}  // namespace jackal_aic
