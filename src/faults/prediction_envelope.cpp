#include "jackal_aic/faults/prediction_envelope.hpp"

#include <algorithm>

namespace jackal_aic {

PredictionEnvelope::PredictionEnvelope(std::size_t behind, std::size_t ahead)
    : behind_(std::min(behind, kLongest)), ahead_(std::min(ahead, kLongest)) {}

void PredictionEnvelope::start(double now, double ahead) {
  now_.fill(now);
  later_.fill(ahead);
}

void PredictionEnvelope::add(double now, double ahead) {
  head_ = (head_ + 1) % now_.size();
  now_[head_] = now;
  later_[head_] = ahead;
}

PredictionEnvelope::Range PredictionEnvelope::span(const Ring& ring, std::size_t head, std::size_t steps) {
  Range range{ring[head], ring[head]};
  for (std::size_t i = 1; i <= steps; ++i) {
    const double value = ring[(head + ring.size() - i) % ring.size()];
    range.low = std::min(range.low, value);
    range.high = std::max(range.high, value);
  }
  return range;
}

PredictionEnvelope::Range PredictionEnvelope::range() const {
  const Range past = span(now_, head_, behind_);
  const Range later = span(later_, head_, ahead_);
  // The prediction that runs ahead was here when it was where the other one is now.
  const double offset = now_[head_] - later_[(head_ + later_.size() - ahead_) % later_.size()];
  return {std::min(past.low, later.low + offset), std::max(past.high, later.high + offset)};
}

double PredictionEnvelope::error(double value) const {
  const Range inside = range();
  return value - std::clamp(value, inside.low, inside.high);
}

double PredictionEnvelope::width() const {
  const Range inside = range();
  return inside.high - inside.low;
}

}  // namespace jackal_aic
