#include "jackal_aic/safety/input_source.hpp"

#include <algorithm>

namespace jackal_aic {

void InputSource::receive(double stamp, double now) {
  if (!received() || stamp != stamp_) in_time_ = late(now) ? 0 : std::min(in_time_ + 1, kBack);
  stamp_ = stamp;
  arrival_ = now;
}

void InputSource::compare(const Sample& sample, bool may_repeat, double now) {
  // By the time of arrival, because the stamps of a frozen source are fresh.
  if (changed_ == -HUGE_VAL || may_repeat || sample != sample_) changed_ = now;
  sample_ = sample;
  frozen_ = longest_repetition_ > 0.0 && now - changed_ > longest_repetition_;
}

bool InputSource::late(double now) const {
  const auto within = [this](double age) { return std::abs(age) <= deadline_; };
  return deadline_ > 0.0 && received() && !(within(now - stamp_) && within(now - arrival_));
}

SourceHealth InputSource::health(double now) const { return {!received(), late(now) || in_time_ < kBack, frozen_}; }

}  // namespace jackal_aic
