#pragma once

/// @file
/// When the next action is due, so that it acts on a measurement that has just come.

#include <array>
#include <cstddef>
#include <cstdint>

namespace jackal_aic {

/// Locks the phase of a periodic action to measurements of about the same rate, or of another one: the action moves to
/// where the recent measurements, had they come with it, would have been youngest on average. One that comes after the
/// action waits for the next, which costs a whole period; one that comes before costs only the wait. So the action
/// comes a little after the measurements, jitter included, and what comes later than that once in a while is not waited
/// for. The period changes by little, up to longestShift(), but once after the start or a silence. Pure bookkeeping
/// without a clock: time enters as nanoseconds. Nothing allocates.
class PhaseLock {
 public:
  /// @param period of the action [ns], 1000 or more.
  explicit PhaseLock(std::int64_t period);

  /// A measurement came at this time [ns], not before the last one. Of several that come less than half a period apart
  /// the first counts: the others were held up.
  void arrived(std::int64_t now);

  /// Time at which the next action is due [ns], after one that was due at `due`: a period later, up to longestShift()
  /// earlier or later; up to two periods where it is not locked yet; `now`, if that was missed by a period.
  /// @param now the present time [ns].
  std::int64_t next(std::int64_t due, std::int64_t now);

  /// Forgets the measurements: the next of them locks the phase again.
  void reset();

  /// Most that a period is lengthened or shortened while locked [ns].
  std::int64_t longestShift() const { return period_ / 40; }

 private:
  static constexpr std::size_t kMost = 40;  // measurements that count, at 50 Hz those of 0.8 s

  std::int64_t drift() const;
  std::int64_t bestShift(std::int64_t due) const;

  std::int64_t period_;
  std::array<std::int64_t, kMost> arrivals_{};  // a ring [ns]
  std::size_t count_ = 0;                       // since the start or a silence
  bool locked_ = false;
};

}  // namespace jackal_aic
