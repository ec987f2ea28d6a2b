#pragma once

/// @file
/// The model of a wheel's drive train, from the command u to the wheel's speed w:
///
///     r     = gain u(t - dead_time) + d
///     dw/dt = clamp((r + z - w) / lag, +- acceleration_limit / radius),    dz/dt = velocity_loop_integral (r - w)
///
/// with the correction z of the motors' velocity loop and a disturbance d of its input. Whatever reckons with a drive
/// train does so by this file: beliefs, reference model, certificates, fault detection, identification, baselines. The
/// motor of the simulated robot is written apart from it on purpose.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>

#include "jackal_aic/model/plant_model.hpp"

namespace jackal_aic {

/// How a drive train without velocity-loop integral goes to its target over a time.
struct Pace {
  double response;        ///< part of the difference gone, 1 - e^(-time/lag)
  double largest_change;  ///< of the speed, by the acceleration limit [rad/s]

  /// Change of a speed towards a target [rad/s].
  double towards(double target, double speed) const {
    return std::clamp(response * (target - speed), -largest_change, largest_change);
  }
};

/// Pace over a time [s]. @param lag [s], 0 follows at once; @param limit of dw/dt [rad/s^2].
Pace paceOf(double lag, double limit, double time);

/// Speed [rad/s] of a drive train without velocity-loop integral after any time [s] with one target: the exact
/// solution, at the acceleration limit and below it. @param lag [s], 0 follows at once; @param limit of dw/dt
/// [rad/s^2].
double speedAfter(double speed, double target, double lag, double limit, double time);

/// Linear response of (w, z) over a time during which one input acts.
struct DriveTrainResponse {
  Eigen::Matrix2d transition;  ///< of (w, z)
  Eigen::Vector2d input;       ///< of r, without the gain
};

/// Exact response below the acceleration limit over a time [s].
DriveTrainResponse driveTrainResponse(const PlantModel& model, double time);

/// Commands of one wheel on their way through the dead time. Nothing here allocates.
class CommandsUnderWay {
 public:
  static constexpr double kStep = 0.001;           ///< between commands [s]; the dead time is a whole number of these
  static constexpr double kLongestDeadTime = 2.0;  ///< a longer one counts as this [s]

  /// @param dead_time [s].
  explicit CommandsUnderWay(double dead_time);

  /// Takes the command of a step; returns the one that acts in it.
  double step(double command) {
    commands_[head_] = command;
    head_ = head_ == delay_ ? 0 : head_ + 1;
    return commands_[head_];  // the oldest
  }

  /// As if this command had been given for long.
  void fill(double command) { commands_.fill(command); }

  /// Dead time in steps.
  std::size_t delay() const { return delay_; }

 private:
  // Ring, one per step, of which delay_ + 1 are in use.
  std::array<double, static_cast<std::size_t>(kLongestDeadTime / kStep) + 1> commands_{};
  std::size_t delay_;
  std::size_t head_ = 0;
};

/// The drive train in steps of 1 ms on x = (w, z, d). Nothing here allocates.
class DriveTrain {
 public:
  static constexpr double kStep = CommandsUnderWay::kStep;  ///< [s]

  /// What a step did.
  struct Step {
    double change;  ///< of w [rad/s]
    bool limited;   ///< by the acceleration limit
  };

  /// @param wheel_radius r [m].
  DriveTrain(const PlantModel& model, double wheel_radius);

  /// Moves x by a step in which a command u [rad/s] acts. At the acceleration limit the speed does not depend on z and
  /// d, and z rests. @param limit_share part of the acceleration limit that the motor has.
  Step step(Eigen::Vector3d& x, double acting, double limit_share = 1.0) const {
    // x ← J x + b u, of which d rests
    const Eigen::Vector2d next = transition_.topRows<2>() * x + input_.head<2>() * acting;
    const double wanted = next(0) - x(0);
    const double largest = limit_share * limit_ * kStep;
    const double change = std::clamp(wanted, -largest, largest);
    if (change == wanted) {
      x.head<2>() = next;
    } else {
      x(0) += change;
    }
    return {change, change != wanted};
  }

  /// Map of x over a step below the acceleration limit, and what a command that acts adds.
  const Eigen::Matrix3d& transition() const { return transition_; }
  const Eigen::Vector3d& input() const { return input_; }  ///< likewise, per rad/s of command

  double gain() const { return gain_; }    ///< wheel speed / command
  double limit() const { return limit_; }  ///< of dw/dt [rad/s^2]

 private:
  double gain_;
  double limit_;
  Eigen::Matrix3d transition_;
  Eigen::Vector3d input_;
};

/// A wheel that does what its drive train does, whatever is measured. Nothing here allocates.
class DriveTrainPrediction {
 public:
  /// At rest. @param wheel_radius r [m].
  DriveTrainPrediction(const PlantModel& model, double wheel_radius);

  /// Goes on by DriveTrain::kStep during which a command u [rad/s] is applied.
  void predict(double command) { drive_train_.step(x_, commands_.step(command)); }

  /// Starts at a speed [rad/s] with a command under way that has been driving it for long.
  void reset(double speed);

  double speed() const { return x_(0); }  ///< w [rad/s]

 private:
  DriveTrain drive_train_;
  CommandsUnderWay commands_;
  Eigen::Vector3d x_ = Eigen::Vector3d::Zero();
};

}  // namespace jackal_aic
