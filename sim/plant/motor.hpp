#pragma once

/// @file
/// The drive train between a wheel command and the physics engine: dead time and velocity loop. No physics engine here.

#include <cstdint>
#include <deque>
#include <utility>

#include "jackal_aic/model/types.hpp"
#include "plant_parameters.hpp"

namespace jackal_aic::sim {

/// Dead time between a command and the motors, in whole steps of the simulation.
class CommandDelay {
 public:
  /// @param dead_time [s], rounded to whole steps; @param step [s].
  CommandDelay(double dead_time, double step);

  /// Takes a command at the start of a step; a later one in the same step replaces it. @param underway steps of its
  /// transport, in which it overtakes no other.
  void push(std::int64_t step, const WheelCommand& command, std::int64_t underway = 0);

  /// The command that drives the motors during a step: the last one pushed at least the dead time earlier, at first
  /// zero. Steps must not decrease from call to call.
  const WheelCommand& acting(std::int64_t step);

 private:
  std::int64_t delay_;
  std::deque<std::pair<std::int64_t, WheelCommand>> pending_;  ///< (first step it acts in, command)
  WheelCommand acting_;
};

/// Closed velocity loop of one motor, with command u, wheel speed w and target r = clamp(gain u, +-speed_limit):
///
///     dw/dt = clamp( (r + z - w) / T, +-acceleration_limit ),    dz/dt = k_i (r - w),
///
/// so that w = gain u at steady state for any k_i. With an offset o, u stands for sign(u) max(0, |u| - o), so o is a
/// dead band, too. A standing wheel ignores a command below the breakaway (stiction). Each step starts from the wheel
/// speed of the physics, so the reference cannot run away from a wheel that the torque limit holds back. z rests while
/// either limit acts (no wind-up).
///
/// A soft loop applies the torque k_p (r + z - w) within its limit. Masses and ground determine the motion; T and the
/// acceleration limit have no effect.
class MotorLoop {
 public:
  /// @param wheel_radius [m], by which the limits of the circumference are those of the wheel; @param step [s].
  MotorLoop(const PlantParameters& parameters, double wheel_radius, double step);

  /// Wheel speed at the end of a step, or r + z of a soft loop [rad/s].
  /// @param command during the step [rad/s]; @param speed of the wheel at its beginning [rad/s]; @param supply share of
  /// the full battery voltage, to which speed and acceleration limit are proportional.
  double reference(double command, double speed, double supply = 1.0);

  /// Sets another wheel speed per command and offset [rad/s].
  void change(double gain, double offset) {
    parameters_.wheel_gain = gain;
    parameters_.wheel_offset = offset;
  }

 private:
  double followed(double command, double speed) const;
  void integrate(double speed);

  PlantParameters parameters_;
  double acceleration_limit_, speed_limit_;  ///< of the wheel [rad/s^2, rad/s]
  double step_;
  double response_;  ///< 1 - exp(-step/T): part of the error that a step removes, exact for a constant command
  double target_ = 0.0;
  double correction_ = 0.0;  ///< z [rad/s]
  double start_speed_ = 0.0;
  double reference_ = 0.0;
  bool limited_ = false;
};

}  // namespace jackal_aic::sim
