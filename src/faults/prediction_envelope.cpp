#include "jackal_aic/faults/prediction_envelope.hpp"

#include <algorithm>

namespace jackal_aic {

PredictionEnvelope::PredictionEnvelope(std::size_t behind, std::size_t ahead)
    : now_(0, std::min(behind, kLongest)), later_(0, std::min(ahead, kLongest)) {}

void PredictionEnvelope::start(double now, double ahead) {
  now_.fill(now);
  later_.fill(ahead);
}

void PredictionEnvelope::add(double now, double ahead) {
  now_.add(now);
  later_.add(ahead);
}

PredictionEnvelope::Range PredictionEnvelope::range() const {
  // The prediction that runs ahead was here when it was where the other one is now.
  const double offset = now_.newest() - later_.oldest();
  return {std::min(now_.low(), later_.low() + offset), std::max(now_.high(), later_.high() + offset)};
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
