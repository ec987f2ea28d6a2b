#include "jackal_aic/channel_monitor.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {

double chebyshevBound(int channels, double false_alarm_rate) { return std::sqrt(channels / false_alarm_rate); }

void LearnedVariance::learn(double error, double variance, double step) {
  factor_ += -std::expm1(-step / memory_) * (error * error / variance - factor_);
  factor_ = std::clamp(factor_, 1.0, kLargestFactor);
}

ChannelState Persistence::update(bool suspect, bool informative, double step) {
  const std::uint64_t window = (std::uint64_t{2} << (parameters_.fault_window - 1)) - 1;
  recent_ = ((recent_ << 1) | (suspect ? 1u : 0u)) & window;
  if (state_ == ChannelState::faulty) {
    if (suspect) good_time_ = 0.0;
    if (!suspect && informative) good_time_ += step;
    if (good_time_ >= parameters_.recovery_time) reset();
    return state_;
  }
  int suspects = 0;
  for (std::uint64_t bits = recent_; bits != 0; bits &= bits - 1) ++suspects;
  state_ = suspect ? ChannelState::outlier : ChannelState::ok;
  if (suspects >= parameters_.fault_samples) condemn();
  return state_;
}

void Persistence::condemn() {
  state_ = ChannelState::faulty;
  good_time_ = 0.0;
}

void Persistence::reset() {
  recent_ = 0;
  good_time_ = 0.0;
  state_ = ChannelState::ok;
}

bool RepetitionTest::update(double value, bool expected, double resolution) {
  constexpr double kChangesAveraged = 10.0;
  const bool repeats = has_last_ && value == last_;
  const double change = has_last_ ? std::abs(value - last_) : 0.0;
  last_ = value;
  has_last_ = true;
  if (expected) {
    run_ = 0;
    suspect_ = false;
    return false;
  }
  if (repeats) {
    ++run_;
    const double chance = std::pow(repeats_ / samples_seen_, run_);
    suspect_ = samples_ > 0 && run_ >= samples_ && chance < kChance && usual_change_ > resolution;
    return suspect_;
  }
  if (!suspect_) {
    repeats_ += run_;
    samples_seen_ += 1.0 + run_;
  }
  run_ = 0;
  suspect_ = false;
  usual_change_ += (change - usual_change_) / kChangesAveraged;
  return false;
}

}  // namespace jackal_aic
