#pragma once

/// @file
/// Outlier bound, persistence of faults, held values and missed motion of one channel. Nothing allocates.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace jackal_aic {

/// Largest Mahalanobis distance of a good sample: d = sqrt(n / alpha).
///
/// Chebyshev's inequality in n dimensions, P(e' S^-1 e >= n / alpha) <= alpha for a zero-mean error e of covariance S,
/// holds for any distribution. The chi-square quantile would be smaller, but the errors of a skid-steer robot are
/// not normal: slip and timing give them heavy tails. For normal errors the bound is far on the safe side (n = 1,
/// alpha = 0.04: d = 5, exceeded by 6 samples in 10 million).
/// @param channels n; @param false_alarm_rate alpha, bound of the rate at which a good sample is called an outlier.
double chebyshevBound(int channels, double false_alarm_rate);

/// Time from one sample to the next, the same for every channel.
struct SampleStep {
  /// @param time since the last sample [s]; @param memory over which covariances are learned [s].
  SampleStep(double time, double memory) : time(time), share(-std::expm1(-time / memory)) {}

  double time;   ///< since the last sample [s]
  double share;  ///< of this sample in what is learned over the memory: 1 - e^(-time/memory)
};

/// Learned variance of a prediction error: lambda S, with the model's variance S and a factor lambda >= 1 that follows
/// the mean of e^2 / S. Outliers are left out, because a few samples of a fault would widen the bound.
class LearnedVariance {
 public:
  /// Largest factor: ten times the configured standard deviation.
  static constexpr double kLargestFactor = 100.0;

  /// e^2 / (lambda S): squared Mahalanobis distance of an error.
  double squaredDistance(double error, double variance) const { return error * error / (factor_ * variance); }

  /// Takes the error of a good sample, whose variance is S by the model. @param share of it in the mean.
  void learn(double error, double variance, double share) {
    factor_ = std::clamp(factor_ + share * (error * error / variance - factor_), 1.0, kLargestFactor);
  }

  /// lambda, in [1, kLargestFactor].
  double factor() const { return factor_; }

 private:
  static constexpr double kInitialFactor = 25.0;  // says little before the noise is known
  double factor_ = kInitialFactor;
};

/// Recent change of a quantity: the integral of its rate with exponential forgetting. Jitter cancels, and a change
/// counts the same in one step or many.
class RecentChange {
 public:
  /// @param memory [s]; 0 remembers nothing.
  explicit RecentChange(double memory) : memory_(memory) {}

  /// Adds a rate [1/s] over a step [s].
  void add(double rate, double step) { value_ = memory_ > step ? (1.0 - step / memory_) * value_ + step * rate : 0.0; }

  double value() const { return value_; }  ///< change over the memory

 private:
  double memory_;
  double value_ = 0.0;
};

/// Verdict on a channel.
enum class ChannelState {
  ok,       ///< its samples count
  outlier,  ///< this sample does not count
  faulty    ///< no sample counts until the channel has recovered
};

/// Numbers of a Persistence.
struct PersistenceParameters {
  int fault_samples = 5;  ///< K suspect ones among the last N samples make a fault
  int fault_window = 8;   ///< N, at most 64
  double recovery_time =
      1.0;  ///< time of good samples without a suspect one after which a faulty channel counts again [s]
};

/// A fault is K outliers among the last N samples. With independent outliers of rate alpha, false alarms have a rate of
/// at most C(N, K) alpha^K per sample.
class Persistence {
 public:
  /// @param parameters K, N and the time of recovery.
  explicit Persistence(const PersistenceParameters& parameters)
      : parameters_(parameters), window_((std::uint64_t{2} << (parameters.fault_window - 1)) - 1) {}

  /// Takes a sample. @param suspect it is an outlier; @param informative false if a fault would not show in it, so that
  /// it does not count for the recovery; @param step time since the last sample [s]; @param conclusive false while the
  /// outliers may have another cause than a fault.
  ChannelState update(bool suspect, bool informative, double step, bool conclusive = true);

  ChannelState state() const { return state_; }  ///< verdict on the channel with its last sample

  /// True if one of the last N samples was suspect.
  bool suspecting() const { return recent_ != 0; }

  /// Declares the channel faulty.
  void declareFaulty();

  /// Forgets all samples; the channel is ok.
  void reset();

 private:
  PersistenceParameters parameters_;
  std::uint64_t window_;      // one bit per sample of it
  std::uint64_t recent_ = 0;  // those of the suspect ones, the last sample lowest
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
