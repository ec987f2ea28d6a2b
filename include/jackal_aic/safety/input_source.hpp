#pragma once

/// @file
/// Age and health of an input of the controller.

#include <Eigen/Core>
#include <cmath>

namespace jackal_aic {

/// Health of a source of measurements.
struct SourceHealth {
  bool missing = false;                             ///< never received
  bool late = false;                                ///< past its deadline, or back for less than five messages
  bool frozen = false;                              ///< it repeats exactly
  bool silent() const { return missing || late; }   ///< no new sample
  bool lost() const { return silent() || frozen; }  ///< unusable
};

/// Watches the messages of one input. Its age is the larger of the age of its stamp and the time since it arrived; a
/// stamp in the future gives a negative age. Noise, and an encoder's position on the move, never repeat exactly, so a
/// source that does for longer is frozen, like the stock driver after the motors' controller died. Nothing allocates.
class InputSource {
 public:
  /// The values that are compared, up to 8; unused ones stay zero.
  using Sample = Eigen::Matrix<double, 8, 1>;

  /// @param deadline largest age [s]; 0: none. @param longest_repetition of a sample [s]; 0: any.
  explicit InputSource(double deadline, double longest_repetition = 0.0)
      : deadline_(deadline), longest_repetition_(longest_repetition) {}

  /// Takes a message. @param stamp of it, @param now time of its arrival [s].
  void receive(double stamp, double now);

  /// Compares a sample with the last one. @param may_repeat exact repetition is normal, as for encoders at rest.
  void compare(const Sample& sample, bool may_repeat, double now);

  /// True if it was received and its age is beyond its deadline, in the past or the future.
  bool late(double now) const;

  /// A late source recovers after some messages in time: one that is slower than its deadline stays lost.
  SourceHealth health(double now) const;

  /// Forgets every message.
  void reset() { *this = InputSource(deadline_, longest_repetition_); }

  bool received() const { return std::isfinite(arrival_); }  ///< since the start
  double stamp() const { return stamp_; }                    ///< of the last message [s]
  double arrival() const { return arrival_; }                ///< of the last message [s]; -infinity before the first
  double deadline() const { return deadline_; }              ///< [s]; 0: none

 private:
  static constexpr int kBack = 5;  // messages in time that end a silence

  double deadline_;
  double longest_repetition_;
  double stamp_ = 0.0;
  double arrival_ = -HUGE_VAL;
  int in_time_ = kBack;         // messages in a row that came within the deadline of the one before
  double changed_ = -HUGE_VAL;  // time of the last sample that differed from the one before, or was allowed to repeat
  bool frozen_ = false;
  Sample sample_ = Sample::Zero();
};

}  // namespace jackal_aic
