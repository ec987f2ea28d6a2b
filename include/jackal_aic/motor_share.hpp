#pragma once

/// @file
/// Tells who has the motors where somebody else may drive: a multiplexer (twist_mux) lets through our commands or
/// another's, and what reached the motors is seen afterwards.

#include <array>
#include <cstddef>

#include "jackal_aic/types.hpp"

namespace jackal_aic {

/// Compares the commands that reached the motors with those that we sent shortly before. They are ours while they lie
/// among ours, or come nearer, as behind a multiplexer with limits of its own; kPatience without that, and they are
/// another's. Then offer() tells what to send: the applied command and a step towards our own wish, so that nothing
/// jumps when the motors are handed back, and so that the motors tell by following it that they are ours again. Nothing
/// here allocates or throws; time never decreases.
class MotorShare {
 public:
  static constexpr double kMemory = 0.3;    ///< longest time that a command takes from here to the motors [s]
  static constexpr double kPatience = 0.2;  ///< with applied commands that are not among ours [s]
  static constexpr double kOffer = 1.5;     ///< largest step of an offer [rad/s], 0.15 m/s
  static constexpr double kSilence = 0.25;  ///< applied commands that stay away for longer tell nothing [s]

  /// A command of ours leaves. @param time [s].
  void send(double time, const WheelCommand& command);

  static constexpr double kTolerance = 0.05;  ///< relative, between a command of ours and what reached the motors

  /// A command reached the motors, whosever it is. @param time [s]; @param tolerance relative: more than kTolerance if
  /// it is inferred only.
  void apply(double time, const WheelCommand& command, double tolerance = kTolerance);

  /// True if it is known what reaches the motors.
  bool known(double time) const { return any_ && time - applied_time_ <= kSilence; }

  /// The command that the motors have, if known().
  const WheelCommand& applied() const { return applied_; }

  /// True unless it is known that the motors follow another.
  bool ours(double time) const { return ours_ || !known(time); }

  /// What to send while the motors follow another. @param goal wheel speeds that we want [rad/s].
  WheelCommand offer(const WheelCommand& goal) const;

  /// Forgets everything.
  void reset() { *this = MotorShare(); }

 private:
  struct Sent {
    double time = 0.0;
    WheelVector command = WheelVector::Zero();
  };

  double distance(double time, const WheelVector& tolerance) const;
  bool follows(const WheelVector& before, const WheelVector& tolerance) const;

  std::array<Sent, 64> sent_{};  // a ring
  std::size_t head_ = 0;
  std::size_t count_ = 0;
  WheelCommand applied_;
  double applied_time_ = 0.0;  // s
  bool any_ = false;
  bool ours_ = true;
  double mark_ = 0.0;       // nearest to our commands since they left them [rad/s]
  double mark_time_ = 0.0;  // when that was [s]
};

}  // namespace jackal_aic
