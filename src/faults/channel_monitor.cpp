#include "jackal_aic/faults/channel_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "jackal_aic/model/thresholds.hpp"

namespace jackal_aic {

ChannelState Persistence::update(bool suspect, bool informative, double step) {
  recent_ <<= 1;
  recent_[0] = suspect;
  if (state_ == ChannelState::faulty) {
    if (suspect) good_time_ = 0.0;
    if (!suspect && informative) good_time_ += step;
    if (good_time_ >= recovery_time_) reset();
    return state_;
  }
  state_ = suspect ? ChannelState::outlier : ChannelState::ok;
  if (recent_.count() >= kSuspects) declareFaulty();
  return state_;
}

void Persistence::declareFaulty() {
  state_ = ChannelState::faulty;
  good_time_ = 0.0;
}

void Persistence::reset() {
  recent_.reset();
  state_ = ChannelState::ok;
}

void SampleHold::update(double value, double least, double step) {
  const double change = value - std::exchange(last_, value);
  if (!(std::abs(change) > 0.0)) {
    held_ += step;
    return;
  }
  const double move = std::abs(change) > least ? change : 0.0;
  if (move * last_move_ > 0.0 && held_ <= thresholds::kPatience && held_ > holds_[0]) {
    holds_[0] = held_;
    std::sort(holds_.begin(), holds_.end());
    longest_ = holds_[0] > 0.0 ? holds_[0] : holds_[2];
  }
  last_move_ = move;
  held_ = 0.0;
}

bool MissedMotion::update(double value, bool repeats, double low, double high, double least, double step, double hold) {
  constexpr double kMemory = 5.0;    // s; what takes longer may be a slow change of the drive train
  constexpr double kLongest = 0.25;  // s, longest patience
  constexpr double kSettled = 3.0;   // times that a source is waited for, in which one that lives shows a change
  unchanged_ += step;
  if (!repeats) {
    patience_ = std::min(std::max(patience_, 2.0 * missed_), kLongest);
    if (unchanged_ < patience_ + thresholds::kRounding) quick_changes_ = std::min(quick_changes_ + 1, kFewChanges);
    unchanged_ = 0.0;
    restart(low, high);
    return false;
  }
  const double wait = (quick_changes_ < kFewChanges ? kLongest : patience_) + 2.0 * hold;
  // A wheel that may have been anywhere as it started is where its prediction has narrowed down to since.
  const auto fade = [step, wait](double& then, double now, bool narrower) {
    then += (now - then) * std::min(step / (narrower ? kSettled * wait : kMemory), 1.0);
  };
  fade(low_, low, low > low_);
  fade(high_, high, high < high_);
  missed_ = std::max(low - std::max(high_, value), std::min(low_, value) - high) > least ? missed_ + step : 0.0;
  return missed_ > wait;
}

}  // namespace jackal_aic
