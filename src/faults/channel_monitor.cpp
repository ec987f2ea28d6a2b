#include "jackal_aic/faults/channel_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {

double chebyshevBound(int channels, double false_alarm_rate) { return std::sqrt(channels / false_alarm_rate); }

ChannelState Persistence::update(bool suspect, bool informative, double step, bool conclusive) {
  recent_ = ((recent_ << 1) | (suspect ? 1u : 0u)) & window_;
  if (state_ == ChannelState::faulty) {
    if (suspect) good_time_ = 0.0;
    if (!suspect && informative) good_time_ += step;
    if (good_time_ >= parameters_.recovery_time) reset();
    return state_;
  }
  int suspects = 0;
  for (std::uint64_t bits = recent_; bits != 0; bits &= bits - 1) ++suspects;
  state_ = suspect ? ChannelState::outlier : ChannelState::ok;
  if (conclusive && suspects >= parameters_.fault_samples) declareFaulty();
  return state_;
}

void Persistence::declareFaulty() {
  state_ = ChannelState::faulty;
  good_time_ = 0.0;
}

void Persistence::reset() {
  recent_ = 0;
  state_ = ChannelState::ok;
}

void SampleHold::update(double value, double least, double step) {
  const double change = value - std::exchange(last_, value);
  if (!(std::abs(change) > 0.0)) {
    held_ += step;
    return;
  }
  const double move = std::abs(change) > least ? change : 0.0;
  if (move * last_move_ > 0.0 && held_ <= kLongest && held_ > holds_[0]) {
    holds_[0] = held_;
    std::sort(holds_.begin(), holds_.end());
    longest_ = holds_[0] > 0.0 ? holds_[0] : holds_[2];
  }
  last_move_ = move;
  held_ = 0.0;
}

}  // namespace jackal_aic
