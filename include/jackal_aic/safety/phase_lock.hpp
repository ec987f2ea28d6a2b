#pragma once

/// @file
/// Due time of the next action, right after a measurement.

#include <array>
#include <cstddef>
#include <cstdint>

namespace jackal_aic {

/// Locks the phase of a periodic action to measurements of any rate: the action moves to the phase with the smallest
/// mean age of the recent measurements. So the action follows the measurements closely, jitter included, and does not
/// wait for rare late ones. The period changes by up to 1/64, or by more once after the start or a silence. No clock:
/// times are passed in nanoseconds. Nothing allocates.
class PhaseLock {
 public:
  /// @param period of the action [ns], 1000 or more.
  explicit PhaseLock(std::int64_t period);

  /// Takes the arrival time of a measurement [ns], not before the last one. Of several within half a period the first
  /// counts: the others were delayed.
  void arrived(std::int64_t now);

  /// Time at which the next action is due [ns], after one that was due at `due`: a period later, plus or minus
  /// 1/64 of it. Up to two periods before the phase is locked. `now` if the time is missed by a period.
  /// @param now the present time [ns].
  std::int64_t next(std::int64_t due, std::int64_t now);

  /// Forgets the measurements: the next of them locks the phase again.
  void reset();

 private:
  static constexpr std::size_t kMost = 40;  // measurements that count, at 50 Hz those of 0.8 s

  std::int64_t margin() const { return period_ / 64; }  // 0.3 ms of 20 ms
  std::int64_t drift() const;
  std::int64_t bestShift(std::int64_t due) const;

  std::int64_t period_;
  std::array<std::int64_t, kMost> arrivals_{};  // a ring [ns]
  std::size_t count_ = 0;                       // since the start or a silence
  bool locked_ = false;
};

}  // namespace jackal_aic
