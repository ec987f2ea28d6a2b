#pragma once

/// @file
/// Parameters of the drive gate: limits of the command, deadlines of the inputs, brake, plausibility.

#include <array>

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic {

/// Bounds of the drive command; defaults as on the stock Jackal. YAML prefix `limits`.
struct LimitParameters {
  double linear_speed = 2.0;           ///< largest |x_dot| of the command [m/s]
  double angular_speed = 4.0;          ///< largest |theta_dot| of the command [rad/s]
  double wheel_speed = 25.5;           ///< largest |omega| of a wheel [rad/s]; 2.5 m/s at r = 0.098 m
  double linear_acceleration = 20.0;   ///< largest |x_ddot| of the command [m/s^2]; 0: none
  double linear_deceleration = 0.0;    ///< largest while |x_dot| falls; 0: as the acceleration
  double angular_acceleration = 25.0;  ///< largest |theta_ddot| of the command [rad/s^2]; 0: none
  double angular_deceleration = 0.0;   ///< largest while |theta_dot| falls; 0: as the acceleration
};

/// Lists the fields of LimitParameters with unit and range.
template <class Visitor>
void describeFields(Visitor& v, LimitParameters& p) {
  v.field("linear_speed", p.linear_speed, {0.01, 10.0}, "m/s", Presence::optional);
  v.field("angular_speed", p.angular_speed, {0.01, 20.0}, "rad/s", Presence::optional);
  v.field("wheel_speed", p.wheel_speed, {0.1, 200.0}, "rad/s", Presence::optional);
  v.field("linear_acceleration", p.linear_acceleration, {0.0, 1000.0}, "m/s^2", Presence::optional);
  v.field("linear_deceleration", p.linear_deceleration, {0.0, 1000.0}, "m/s^2", Presence::optional);
  v.field("angular_acceleration", p.angular_acceleration, {0.0, 1000.0}, "rad/s^2", Presence::optional);
  v.field("angular_deceleration", p.angular_deceleration, {0.0, 1000.0}, "rad/s^2", Presence::optional);
}

/// Ages beyond which an input no longer counts, 0 for never. YAML prefix `deadlines`.
struct DeadlineParameters {
  double set_point = 0.5;      ///< largest age of the set point [s]
  double wheels = 0.2;         ///< largest age of the wheel speeds [s]
  double imu = 0.2;            ///< largest age of the IMU data [s]
  double feedback = 0.2;       ///< largest age of the motors' feedback, once there was any [s]
  double frozen_wheels = 0.3;  ///< longest exact repetition of the wheels' data on the move [s]
  double frozen_imu = 0.3;     ///< longest exact repetition of IMU data [s]; 0 for a noiseless IMU
};

/// Lists the fields of DeadlineParameters with unit and range.
template <class Visitor>
void describeFields(Visitor& v, DeadlineParameters& p) {
  v.field("set_point", p.set_point, {0.0, 60.0}, "s", Presence::optional);
  v.field("wheels", p.wheels, {0.0, 10.0}, "s", Presence::optional);
  v.field("imu", p.imu, {0.0, 10.0}, "s", Presence::optional);
  v.field("feedback", p.feedback, {0.0, 10.0}, "s", Presence::optional);
  v.field("frozen_wheels", p.frozen_wheels, {0.0, 10.0}, "s", Presence::optional);
  v.field("frozen_imu", p.frozen_imu, {0.0, 10.0}, "s", Presence::optional);
}

/// Brake of a robot that may not drive on. YAML prefix `brake`.
struct BrakeParameters {
  double time = 1.0;                  ///< longest time to a zero command, from any speed [s]
  double linear_deceleration = 3.0;   ///< of x_dot; more if `time` requires it [m/s^2]
  double angular_deceleration = 6.0;  ///< of theta_dot; more if `time` requires it [rad/s^2]
  double fault_hold = 1.0;            ///< time that a fault must be gone before it can be acknowledged [s]
};

/// Lists the fields of BrakeParameters with unit and range.
template <class Visitor>
void describeFields(Visitor& v, BrakeParameters& p) {
  v.field("time", p.time, {0.02, 10.0}, "s", Presence::optional);
  v.field("linear_deceleration", p.linear_deceleration, {0.01, 1000.0}, "m/s^2", Presence::optional);
  v.field("angular_deceleration", p.angular_deceleration, {0.01, 1000.0}, "rad/s^2", Presence::optional);
  v.field("fault_hold", p.fault_hold, {0.0, 60.0}, "s", Presence::optional);
}

/// When a belief counts as diverged, and a measurement as impossible. YAML prefix `plausibility`.
struct PlausibilityParameters {
  double speed_factor = 5.0;  ///< largest velocity, in multiples of the speed limits
};

/// Lists the fields of PlausibilityParameters with unit and range.
template <class Visitor>
void describeFields(Visitor& v, PlausibilityParameters& p) {
  v.field("speed_factor", p.speed_factor, {1.0, 1000.0}, "", Presence::optional);
}

/// How the latch of a stop by a person or the robot is released (Severity::halt). YAML key `restart_after_stop`.
enum class RestartPolicy {
  acknowledged,  ///< by a zero set point, or a pause of the set points, after the stop is over
  at_once        ///< by the end of the stop; the set point in force counts
};

/// Words of RestartPolicy, in the order of the enumerators.
inline constexpr std::array<const char*, 2> kRestartPolicyNames{"acknowledged", "at_once"};

/// All parameters of the drive gate.
struct GateParameters {
  LimitParameters limits;                                          ///< of speed and acceleration
  DeadlineParameters deadlines;                                    ///< of the inputs
  BrakeParameters brake;                                           ///< how it brakes
  PlausibilityParameters plausibility;                             ///< of beliefs and measurements
  RestartPolicy restart_after_stop = RestartPolicy::acknowledged;  ///< release of the latch
};

/// Reads limits.*, deadlines.*, brake.*, plausibility.* and restart_after_stop. @throws ParameterError also as
/// validate().
GateParameters readGateParameters(ParameterMap& map, GateParameters defaults = {});

/// @throws ParameterError if the brake needs more than a given deceleration limit for its time or deceleration.
/// Without a limit a brake may be harder than the acceleration.
void validate(const LimitParameters& limits, const BrakeParameters& brake);

}  // namespace jackal_aic
