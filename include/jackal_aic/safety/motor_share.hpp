#pragma once

/// @file
/// Detects the source that drives the motors behind a multiplexer (twist_mux), which passes our commands or those of
/// another source, by the commands that reached the motors.

#include <array>
#include <cstddef>
#include <optional>

#include "jackal_aic/model/thresholds.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Evidence of the commands that reached the motors.
enum class AppliedSource {
  drive,  ///< the robot publishes its motors' commands; overrides the others
  twist,  ///< output of the multiplexer; silence is a stop, as for the stock velocity controller
  wheels  ///< without the other two the measured wheel speeds stand for the commands, so they reveal no faulty wheel
};

/// Compares the commands that reached the motors with those that we sent shortly before. They are ours while they lie
/// among ours or approach them, as behind a multiplexer with limits. After thresholds::kPatience without that, another
/// source drives; a command also reaches the motors within that time, and applied commands older than that do not
/// count. While another source drives, offer() is the command to send: the applied command and a step towards our goal.
/// So the command does not jump at the hand-over, and motors that follow the step are ours again. Nothing here
/// allocates or throws; time never decreases.
class MotorShare {
 public:
  static constexpr double kOffer = 1.5;  ///< largest step of an offer [rad/s], 0.15 m/s

  /// Takes a command that we send. @param time [s].
  void send(double time, const WheelCommand& command);

  static constexpr double kTolerance = 0.05;      ///< relative, between a command of ours and what reached the motors
  static constexpr double kWheelTolerance = 0.3;  ///< the same by the measured wheels

  /// Takes a command of any source that reached the motors. @param time [s].
  void apply(double time, const WheelCommand& command, AppliedSource source);

  /// The command of the motors; empty if unknown. @param time [s].
  std::optional<WheelCommand> applied(double time);

  /// The command of the motors if it is not ours; else, or if unknown, empty. @param time [s].
  std::optional<WheelCommand> another(double time);

  /// True if only the measured wheel speeds show what reached the motors.
  bool fromWheelsAlone() const { return any_ && !any_drive_ && !any_twist_; }

  /// False while another source drives.
  bool ours(double time) const { return ours_ || !known(time); }

  /// Command to send while another source drives. @param goal wheel speeds that we want [rad/s].
  WheelCommand offer(const WheelCommand& goal) const;

  /// Forgets everything.
  void reset() { *this = MotorShare(); }

 private:
  struct Sent {
    double time = 0.0;
    WheelVector command = WheelVector::Zero();
  };

  bool known(double time) const { return any_ && time - applied_time_ <= thresholds::kPatience; }
  void apply(double time, const WheelCommand& command, double tolerance);
  double distance(double time, const WheelVector& tolerance) const;
  bool follows(const WheelVector& before, const WheelVector& tolerance) const;

  std::array<Sent, 320> sent_{};  // a ring, of 0.3 s at the highest action rate, 1 kHz
  std::size_t head_ = 0;
  std::size_t count_ = 0;
  WheelCommand applied_;
  double applied_time_ = 0.0;  // s
  bool any_ = false;
  bool any_drive_ = false;
  bool any_twist_ = false;
  bool ours_ = true;
  double mark_ = 0.0;       // least distance from our commands since the applied ones differ [rad/s]
  double mark_time_ = 0.0;  // when that was [s]
};

}  // namespace jackal_aic
