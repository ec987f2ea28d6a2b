#pragma once

/// @file
/// Persistence of faults, held values and missed motion of one channel. Nothing allocates.

#include <array>
#include <bitset>
#include <cstddef>
#include <limits>

namespace jackal_aic {

/// Verdict on a channel.
enum class ChannelState {
  ok,       ///< its samples count
  outlier,  ///< this sample does not count
  faulty    ///< no sample counts until the channel has recovered
};

/// A fault is kSuspects outliers among the last kWindow samples. With independent outliers of rate alpha, false alarms
/// have a rate of at most C(kWindow, kSuspects) alpha^kSuspects per sample.
class Persistence {
 public:
  static constexpr std::size_t kSuspects = 5;  ///< of the window make a fault
  static constexpr std::size_t kWindow = 8;    ///< samples

  /// @param recovery_time of good samples after which a faulty channel counts again [s].
  explicit Persistence(double recovery_time) : recovery_time_(recovery_time) {}

  /// Takes a sample. @param suspect it is an outlier; @param informative false if a fault would not show in it, so that
  /// it does not count for the recovery; @param step time since the last sample [s].
  ChannelState update(bool suspect, bool informative, double step);

  ChannelState state() const { return state_; }  ///< verdict on the channel with its last sample

  /// True if a sample of the window was suspect.
  bool suspecting() const { return recent_.any(); }

  /// Declares the channel faulty.
  void declareFaulty();

  /// Forgets all samples; the channel is ok.
  void reset();

 private:
  double recovery_time_;
  std::bitset<kWindow> recent_;  // suspect ones, the last sample lowest
  double good_time_ = 0.0;
  ChannelState state_ = ChannelState::ok;
};

/// Learns for how long a source holds its value between renewals, for example encoders renewed at 4 Hz and published at
/// 20. Repetitions between two changes in the same direction, both larger than noise, were held. At least three such
/// runs are needed.
class SampleHold {
 public:
  /// Takes a sample. @param least smallest change beyond the noise; @param step time since the last sample [s].
  void update(double value, double least, double step);

  /// Longest usual hold [s]; 0 if every sample is new. Before it is known, the longest hold so far.
  double longest() const { return longest_; }

  /// Time for which the last value has been held [s].
  double held() const { return held_; }

 private:
  std::array<double, 3> holds_{};  // the longest three, rising [s]
  double longest_ = 0.0;           // longest() [s]
  // NaN before the first, which changes nothing.
  double last_ = std::numeric_limits<double>::quiet_NaN();
  double last_move_ = 0.0;  // the last change, if it was too large for noise
  double held_ = 0.0;       // [s]
};

/// Finds a frozen source by the motion that it misses. Its value repeats while the interval of its prediction has moved
/// by more than some steps of its resolution since the last change. The old interval follows the new one over seconds,
/// because a slow drift belongs to the drive train.
class MissedMotion {
 public:
  /// Number of changes, each within the patience, from which the patience is used. Before, the longest patience is
  /// used.
  static constexpr int kFewChanges = 10;

  /// Takes a sample. @param repeats it equals the last one; @param low, high interval of the prediction; @param least
  /// motion that must show; @param step time since the last sample [s]; @param hold usual hold of the source [s].
  /// @returns true while a motion is missed for longer than the patience.
  bool update(double value, bool repeats, double low, double high, double least, double step, double hold = 0.0);

  /// Misses nothing so far. @param low, high as in update().
  void restart(double low, double high) {
    low_ = low;
    high_ = high;
    missed_ = 0.0;
  }

 private:
  double low_ = 0.0, high_ = 0.0;  // where it was, since the value changed last
  double missed_ = 0.0;            // [s]
  double patience_ = 0.1;          // [s]; grows for a source that is renewed now and then
  double unchanged_ = 0.0;         // for how long the value has been what it is [s]
  int quick_changes_ = 0;          // within the patience, up to kFewChanges
};

}  // namespace jackal_aic
