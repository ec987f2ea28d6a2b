#pragma once

/// @file
/// The model of a wheel's drive train, from the command u to the wheel's speed w:
///
///     r     = gain v(t - dead_time) + d,    gain v = sign(u) max(0, gain |u| - offset)
///     dw/dt = clamp((r + z - w) / lag, +- acceleration_limit / radius),    dz/dt = velocity_loop_integral (r - w)
///
/// with the correction z of the motors' velocity loop and a disturbance d of its input. Beliefs, reference model,
/// certificates, fault detection and baselines share this model. The motor of the simulated robot is separate on
/// purpose.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "jackal_aic/model/plant_model.hpp"

namespace jackal_aic {

/// Dead zone of motors that turn slower than commanded by a fixed amount, and stand below it: 0.5 rad/s on some Jackals
/// (clearpath_robot#280). Its output, the effective command v, is the input of the linear drive train. The inverse is
/// smooth, as in adaptive control (Tao and Kokotovic 1994; Zhou, Wen and Zhang 2006): the exact inverse jumps at zero,
/// where noise would make it chatter. With a zero offset the command passes unchanged.
class DeadZone {
 public:
  /// Wheel speed below which the inverse corrects only a part of the offset [rad/s]; 1 cm/s of a Jackal. The noise of a
  /// belief at rest, 0.04 rad/s with the shipped encoders, then makes commands of less than half the offset.
  static constexpr double kSmooth = 0.1;

  /// @param model gain and offset.
  explicit DeadZone(const PlantModel& model) : width_(model.offset / model.gain), slope_(model.offset / kSmooth) {}

  /// Effective command v [rad/s], with which the wheel turns by gain v, of a command u [rad/s].
  double effective(double command) const {
    if (width_ == 0.0) return command;
    // v = sign(u) max(0, |u| − offset/gain)
    return std::copysign(std::max(0.0, std::abs(command) - width_), command);
  }

  /// Command u [rad/s] of an effective command [rad/s]. Below a speed of kSmooth the command is smaller, and the wheel
  /// stands. Odd, continuous, increasing, and zero at zero.
  double command(double effective) const {
    if (width_ == 0.0) return effective;
    // u = v + sign(v) min(|v|/v_s, 1) offset/gain,  gain v_s = kSmooth
    return effective + std::clamp(slope_ * effective, -width_, width_);
  }

 private:
  double width_;  // offset/gain [rad/s]
  double slope_;  // of what is added to a small effective command
};

/// A value within +- largest.
inline double limited(double value, double largest) { return std::min(largest, std::max(-largest, value)); }

/// Response of a drive train without velocity-loop integral to its target over a time.
struct Pace {
  double response;        ///< part of the difference closed, 1 - e^(-time/lag)
  double largest_change;  ///< of the speed, by the acceleration limit [rad/s]

  /// Change of a speed towards a target [rad/s].
  double towards(double target, double speed) const { return limited(response * (target - speed), largest_change); }
};

/// Response over a time [s]. @param lag [s], 0 follows at once; @param limit of dw/dt [rad/s^2].
Pace paceOf(double lag, double limit, double time);

/// Linear response of (w, z) over a time during which one input acts.
struct DriveTrainResponse {
  Eigen::Matrix2d transition;  ///< of (w, z)
  Eigen::Vector2d input;       ///< of r, without the gain
};

/// Exact response below the acceleration limit over a time [s].
DriveTrainResponse driveTrainResponse(const PlantModel& model, double time);

/// Commands of one wheel within the dead time. Only the constructor allocates.
class CommandsUnderWay {
 public:
  static constexpr double kStep = 0.001;           ///< between commands [s]; the dead time is a whole number of these
  static constexpr double kLongestDeadTime = 2.0;  ///< upper bound [s]

  /// @param dead_time [s]; @param longest upper bound of later dead times [s].
  explicit CommandsUnderWay(double dead_time, double longest = kLongestDeadTime);

  /// Takes the command of a step; returns the one that acts in it.
  double step(double command) {
    commands_[head_] = command;
    head_ = head_ == delay_ ? 0 : head_ + 1;
    return commands_[head_];  // the oldest
  }

  /// Fills the dead time with this command.
  void fill(double command) { std::fill(commands_.begin(), commands_.end(), command); }

  /// Sets another dead time [s]: keeps the latest commands, and fills the rest with the oldest known one.
  void setDeadTime(double dead_time);

  /// Number of steps in a time [s]; 0 in a negative one.
  static std::size_t stepsOf(double time) { return static_cast<std::size_t>(std::lround(std::max(0.0, time) / kStep)); }

  /// Dead time in steps.
  std::size_t delay() const { return delay_; }

  /// The command of an age [steps], at most the dead time.
  double at(std::size_t age) const {
    const std::size_t place = head_ + delay_ - age;
    return commands_[place > delay_ ? place - delay_ - 1 : place];
  }

  /// The command that acts now.
  double acting() const { return commands_[head_]; }

 private:
  std::size_t delay_;
  std::vector<double> commands_;  // ring, one per step; delay_ + 1 of them are in use
  std::size_t head_ = 0;
};

/// The drive train in steps of 1 ms on x = (w, z, d). Nothing here allocates.
class DriveTrain {
 public:
  static constexpr double kStep = CommandsUnderWay::kStep;  ///< [s]

  /// Result of a step.
  struct Step {
    double change;  ///< of w [rad/s]
    bool limited;   ///< by the acceleration limit
  };

  /// @param wheel_radius r [m].
  DriveTrain(const PlantModel& model, double wheel_radius);

  /// Moves x by a step in which an effective command v [rad/s] acts. At the acceleration limit the speed does not
  /// depend on z and d, and z rests.
  Step step(Eigen::Vector3d& x, double acting) const {
    // x ← J x + b u, d unchanged
    const Eigen::Vector2d next = transition_.topRows<2>() * x + input_.head<2>() * acting;
    const double wanted = next(0) - x(0);
    const double change = limited(wanted, limit_ * kStep);
    if (change == wanted) {
      x.head<2>() = next;
    } else {
      x(0) += change;
    }
    return {change, change != wanted};
  }

  /// Map of x over a step below the acceleration limit.
  const Eigen::Matrix3d& transition() const { return transition_; }
  const Eigen::Vector3d& input() const { return input_; }  ///< change per rad/s of effective command

  double gain() const { return gain_; }    ///< wheel speed / effective command
  double limit() const { return limit_; }  ///< of dw/dt [rad/s^2]

 private:
  double gain_;
  double limit_;
  Eigen::Matrix3d transition_;
  Eigen::Vector3d input_;
};

}  // namespace jackal_aic
