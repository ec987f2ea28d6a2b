#include "jackal_aic/safety/frozen_source.hpp"

namespace jackal_aic {

void FrozenSource::update(double time, const Sample& sample, bool may_repeat) {
  if (!any_ || may_repeat || sample != last_) changed_ = time;
  any_ = true;
  last_ = sample;
  frozen_ = longest_ > 0.0 && time - changed_ > longest_;
}

}  // namespace jackal_aic
