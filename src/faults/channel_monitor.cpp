#include "jackal_aic/faults/channel_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

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

bool RepetitionTest::update(double value, bool expected, double resolution, double explained, double share) {
  const double change = take(value, resolution);
  if (change != 0.0) {
    learnRun();
    learnChange(change, explained);
    return false;
  }
  if (expected) {
    learnExpected(value);
    return false;
  }
  const int run = run_++;
  const double noise = share * usual_change_;
  if (!carriesNoise(noise, resolution)) return false;
  constexpr double kPriorSamples = 50.0;
  chance_ *= (repeats_ + run + kPriorSamples * expectedChance(noise)) / (noisy_ + repeats_ + run + kPriorSamples);
  return repeatsForLong() && chance_ < kChance;
}

void RepetitionTest::pass(double value, double resolution) {
  const double change = take(value, resolution);
  if (change == 0.0) return learnExpected(value);
  learnRun();
  last_change_ = change;
  uncounted_ = 0.0;
}

/// Change since the last value; NaN of the first.
double RepetitionTest::take(double value, double resolution) {
  const double change = value - std::exchange(last_, value), size = std::abs(change);
  if (size > resolution) {
    quantum_ = std::min(quantum_, size);
    if (changes_ < kFewChanges) ++changes_;
  }
  return change;
}

/// A slow wheel shows repetitions and noise of its encoder; one at rest neither.
void RepetitionTest::learnExpected(double value) {
  learnRun();
  if (value != 0.0) repeats_ += 1.0;
}

void RepetitionTest::learnRun() {
  if (run_ == 0) return;
  repeats_ += run_;
  run_ = 0;
  chance_ = 1.0;
}

void RepetitionTest::learnChange(double change, double explained) {
  const bool reverses = change * last_change_ < 0.0;
  const double size = std::abs(change) > 2.0 * explained ? std::abs(change) : 0.0;
  last_change_ = change;
  if (!reverses || size == 0.0) {
    uncounted_ = size;
    return;
  }
  // Of noise that goes to and fro, both ways are.
  if (uncounted_ > 0.0) countNoise(uncounted_);
  countNoise(size);
  uncounted_ = 0.0;
}

void RepetitionTest::countNoise(double size) {
  constexpr double kChangesAveraged = 10.0;
  constexpr double kMemory = 3000.0;  // samples, a minute at 50 Hz
  noisy_ += 1.0;
  const double weight = 1.0 / std::min(noisy_, kChangesAveraged);
  usual_change_ += weight * (size - usual_change_);
  noisy_value_ += weight * (std::abs(last_) - noisy_value_);
  if (noisy_ + repeats_ < kMemory) return;
  noisy_ *= 0.5;
  repeats_ *= 0.5;
}

bool RepetitionTest::carriesNoise(double noise, double resolution) const {
  constexpr double kFine = 2.0;    // steps of the resolution that the noise passes from sample to sample
  constexpr double kCoarse = 1.5;  // ... of a noise that is known by
  constexpr double kMany = 25.0;   // samples
  constexpr double kEnough = 5.0;  // samples of noise to know how large it is
  constexpr double kRare = 2.0;    // repetitions by samples of noise, above which these are shoves of the ground
  const double steps = noisy_ < kMany ? kFine : kCoarse;
  return noisy_ >= kEnough && repeats_ < kRare * noisy_ && noise > std::max(resolution, steps * quantum_);
}

double RepetitionTest::expectedChance(double noise) const {
  constexpr double kGaussian = 0.5;  // above 0.34, of the mean change
  return kGaussian * quantum_ / noise;
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

bool MissedMotion::update(double value, bool repeats, double low, double high, double least, double step, double hold) {
  constexpr double kMemory = 5.0;     // s; what takes longer may be a slow change of the drive train
  constexpr double kLongest = 0.25;   // s, longest patience
  constexpr double kSettled = 3.0;    // times that a source is waited for, in which one that lives shows a change
  constexpr double kRounding = 1e-6;  // s
  unchanged_ += step;
  if (!repeats) {
    patience_ = std::min(std::max(patience_, 2.0 * missed_), kLongest);
    if (unchanged_ < patience_ + kRounding) quick_changes_ = std::min(quick_changes_ + 1, kFewChanges);
    unchanged_ = missed_ = 0.0;
    low_ = low;
    high_ = high;
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
