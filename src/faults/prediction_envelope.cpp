#include "jackal_aic/faults/prediction_envelope.hpp"

#include <algorithm>

namespace jackal_aic {

PredictionEnvelope::PredictionEnvelope(std::size_t behind, std::size_t ahead)
    : now_(std::min(behind, kLongest)), later_(std::min(ahead, kLongest)) {}

void PredictionEnvelope::start(double now, double ahead) {
  now_.fill(now);
  later_.fill(ahead);
  looked_ = false;
}

void PredictionEnvelope::look() const {
  // The prediction that runs ahead was here when it was where the other one is now.
  const double offset = now_.newest() - later_.oldest();
  const auto now = now_.range(), later = later_.range();
  range_ = {std::min(now.low, later.low + offset), std::max(now.high, later.high + offset)};
  looked_ = true;
}

}  // namespace jackal_aic
