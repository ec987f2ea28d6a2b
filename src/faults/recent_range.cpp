#include "jackal_aic/faults/recent_range.hpp"

namespace jackal_aic {

RecentRange::RecentRange(std::size_t oldest) : oldest_(oldest) {
  while (mask_ < oldest + kBlock) mask_ = 2 * mask_ + 1;  // the block of the newest value has none in use that is old
  values_.resize(mask_ + 1);
  blocks_.resize(values_.size() / kBlock);
  fill(0.0);
}

void RecentRange::fill(double value) {
  std::fill(values_.begin(), values_.end(), value);
  std::fill(blocks_.begin(), blocks_.end(), Range{value, value});
  looked_ = false;
}

RecentRange::Range RecentRange::range() const {
  if (!looked_) look();
  return range_;
}

void RecentRange::look() const {
  range_ = {newest(), newest()};
  const auto include = [this](double low, double high) {
    range_.low = std::min(range_.low, low);
    range_.high = std::max(range_.high, high);
  };
  std::size_t left = oldest_ + 1;  // values that have not been looked at, the last ones
  const auto next = [&] { return (now_ + 1 - left) & mask_; };
  for (; left > 0 && next() % kBlock != 0; --left) include(values_[next()], values_[next()]);
  for (; left > 0; left -= std::min(left, kBlock)) include(blocks_[next() / kBlock].low, blocks_[next() / kBlock].high);
  looked_ = true;
}

}  // namespace jackal_aic
