#pragma once

/// @file
/// Parameters of the simulated Jackal. Geometry and inertia come from the URDF.

#include <array>
#include <cstdint>

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic::sim {

inline constexpr double kRadiansPerDegree = 0.017453292519943295;

/// How the robot stands.
enum class Support {
  ground,  ///< wheels on the ground
  box      ///< chassis held up on a box, wheels free (thesis section 4-1)
};

/// Words of Support, in the order of the enumerators.
inline constexpr std::array<const char*, 2> kSupportNames{"ground", "box"};

/// Parameters of the plant; defaults are those of config/plant.yaml. YAML prefix `plant`.
struct PlantParameters {
  Support support = Support::ground;      ///< on the ground or on a box
  double dead_time = 0.08;                ///< from a command to the motors [s]
  double motor_lag = 0.00636;             ///< time constant of the closed velocity loop [s]
  double wheel_gain = 1.0;                ///< true wheel speed / commanded wheel speed, at steady state
  double velocity_loop_integral = 0.678;  ///< integral gain of the velocity loop [1/s]
  double velocity_loop_stiffness = 0.0;   ///< torque / speed error, instead of lag and limit; 0: off [N m s/rad]
  double acceleration_limit = 1.65;       ///< of the wheel circumference under the velocity loop [m/s^2]
  double speed_limit = 2.5;               ///< of the wheel circumference, the robot's maximum [m/s]
  double torque_limit = 20.0;             ///< largest torque per wheel [N m]
  double wheel_offset = 0.0;              ///< wheels turn slower than commanded by this [rad/s]
  double wheel_breakaway = 0.0;           ///< stiction: least command that starts a wheel [rad/s]
  double wheel_radius_left = 0.0;         ///< of the left tyres; 0: that of the URDF [m]
  double wheel_radius_right = 0.0;        ///< of the right tyres; 0: that of the URDF [m]
  double battery_sag = 0.0;               ///< share of the voltage lost at full torque of all wheels
  double battery_discharge = 0.0;         ///< share of the voltage lost per hour [1/h]
  double payload = 0.0;                   ///< extra mass on the chassis, spread as its own [kg]
  double payload_x = 0.0;                 ///< of the payload ahead of the chassis' centre of mass [m]
  double payload_y = 0.0;                 ///< of the payload left of the chassis' centre of mass [m]
  double payload_z = 0.0;                 ///< of the payload above the chassis' centre of mass [m]
  double friction = 0.5;                  ///< Coulomb coefficient between wheels and ground
  double slope = 0.0;                     ///< inclination of the ground, uphill along the initial heading [deg]
  double roughness = 0.0;                 ///< root mean square of the height of uneven ground, at random [m]
  double roughness_length = 1.0;          ///< middle wavelength of uneven ground [m]
  double ramp = 0.0;                      ///< inclination of a ramp across the way, positive is uphill [deg]
  double ramp_start = 3.0;                ///< distance of the ramp ahead of the start [m]
  double ramp_length = 3.0;               ///< length of the ramp, after which the ground is level again [m]
  double patch_friction = 1.0;            ///< friction of the slipperiest patch / friction
  double patch_size = 1.0;                ///< side of the square patches [m]
  double kerb_distance = 0.0;             ///< distance of a kerb ahead of the start; 0: none [m]
  double kerb_height = 0.1;               ///< height of the kerb; a wall if above the wheels' hubs [m]
  double sensor_rate = 50.0;              ///< rate of encoders and IMU [Hz]
  double imu_rate = 0.0;                  ///< rate of the IMU; 0: with the encoders [Hz]
  double feedback_rate = 0.0;             ///< rate of the feedback that joint states repeat; 0: theirs [Hz]
  double feedback_repeats = 0.0;          ///< share of the joint states that repeat the last feedback
  double measurement_loss = 0.0;          ///< share of the samples that are lost
  double noise_scale = 1.0;               ///< factor on all noise below; 0 switches it off
  double encoder_noise = 0.03;            ///< standard deviation of the wheel speed [rad/s]
  double encoder_step = 0.0;              ///< resolution of the measured wheel speed [rad/s]; 0: none
  double encoder_filter = 0.0;            ///< time constant of the encoders' low-pass [s]; 0: none
  double gyro_noise = 0.005;              ///< standard deviation of the angular velocity [rad/s]
  double accelerometer_noise = 0.05;      ///< standard deviation of the acceleration [m/s^2]
  double gyro_bias = 0.0;                 ///< standard deviation of the gyro's bias, which wanders [rad/s]
  double gyro_bias_time = 300.0;          ///< correlation time of the gyro's bias [s]
  double vibration_x = 0.0;               ///< deviation by vibration at 1 m/s, proportional to speed: forward [m/s^2]
  double vibration_y = 0.0;               ///< ... sideways [m/s^2]
  double vibration_z = 0.0;               ///< ... upwards [m/s^2]
  double vibration_gyro = 0.0;            ///< ... of the angular velocity [rad/s]
  double vibration_time = 0.02;           ///< correlation time of the vibration [s]
  double stamp_jitter = 0.0;              ///< longest delay of a sample and its stamp [s]
  double network_delay = 0.0;             ///< longest delay of sensor messages and commands [s]
  std::uint64_t seed = 1;                 ///< of all random numbers
};

/// Lists the fields of PlantParameters with unit and range.
template <class Visitor>
void describeFields(Visitor& v, PlantParameters& p) {
  v.field("support", p.support, kSupportNames, Presence::optional);
  v.field("dead_time", p.dead_time, {0.0, 2.0}, "s", Presence::optional);
  v.field("motor_lag", p.motor_lag, {0.0, 2.0}, "s", Presence::optional);
  v.field("wheel_gain", p.wheel_gain, {0.1, 3.0}, "", Presence::optional);
  v.field("velocity_loop_integral", p.velocity_loop_integral, {0.0, 100.0}, "1/s", Presence::optional);
  v.field("velocity_loop_stiffness", p.velocity_loop_stiffness, {0.0, 1000.0}, "N m s/rad", Presence::optional);
  v.field("acceleration_limit", p.acceleration_limit, {0.1, 1000.0}, "m/s^2", Presence::optional);
  v.field("speed_limit", p.speed_limit, {0.01, 100.0}, "m/s", Presence::optional);
  v.field("torque_limit", p.torque_limit, {0.1, 1000.0}, "N m", Presence::optional);
  v.field("wheel_offset", p.wheel_offset, {0.0, 10.0}, "rad/s", Presence::optional);
  v.field("wheel_breakaway", p.wheel_breakaway, {0.0, 10.0}, "rad/s", Presence::optional);
  v.field("wheel_radius_left", p.wheel_radius_left, {0.0, 1.0}, "m", Presence::optional);
  v.field("wheel_radius_right", p.wheel_radius_right, {0.0, 1.0}, "m", Presence::optional);
  v.field("battery_sag", p.battery_sag, {0.0, 0.5}, "", Presence::optional);
  v.field("battery_discharge", p.battery_discharge, {0.0, 10.0}, "1/h", Presence::optional);
  v.field("payload", p.payload, {0.0, 100.0}, "kg", Presence::optional);
  v.field("payload_x", p.payload_x, {-1.0, 1.0}, "m", Presence::optional);
  v.field("payload_y", p.payload_y, {-1.0, 1.0}, "m", Presence::optional);
  v.field("payload_z", p.payload_z, {-1.0, 1.0}, "m", Presence::optional);
  v.field("friction", p.friction, {0.0, 5.0}, "", Presence::optional);
  v.field("slope", p.slope, {-45.0, 45.0}, "deg", Presence::optional);
  v.field("roughness", p.roughness, {0.0, 0.1}, "m", Presence::optional);
  v.field("roughness_length", p.roughness_length, {0.2, 100.0}, "m", Presence::optional);
  v.field("ramp", p.ramp, {-30.0, 30.0}, "deg", Presence::optional);
  v.field("ramp_start", p.ramp_start, {0.0, 1000.0}, "m", Presence::optional);
  v.field("ramp_length", p.ramp_length, {0.0, 1000.0}, "m", Presence::optional);
  v.field("patch_friction", p.patch_friction, {0.0, 1.0}, "", Presence::optional);
  v.field("patch_size", p.patch_size, {0.1, 100.0}, "m", Presence::optional);
  v.field("kerb_distance", p.kerb_distance, {0.0, 1000.0}, "m", Presence::optional);
  v.field("kerb_height", p.kerb_height, {0.0, 10.0}, "m", Presence::optional);
  v.field("sensor_rate", p.sensor_rate, {1.0, 1000.0}, "Hz", Presence::optional);
  v.field("imu_rate", p.imu_rate, {0.0, 1000.0}, "Hz", Presence::optional);
  v.field("feedback_rate", p.feedback_rate, {0.0, 1000.0}, "Hz", Presence::optional);
  v.field("feedback_repeats", p.feedback_repeats, {0.0, 1.0}, "", Presence::optional);
  v.field("measurement_loss", p.measurement_loss, {0.0, 1.0}, "", Presence::optional);
  v.field("noise_scale", p.noise_scale, {0.0, 1000.0}, "", Presence::optional);
  v.field("encoder_noise", p.encoder_noise, {0.0, 10.0}, "rad/s", Presence::optional);
  v.field("encoder_step", p.encoder_step, {0.0, 10.0}, "rad/s", Presence::optional);
  v.field("encoder_filter", p.encoder_filter, {0.0, 10.0}, "s", Presence::optional);
  v.field("gyro_noise", p.gyro_noise, {0.0, 10.0}, "rad/s", Presence::optional);
  v.field("accelerometer_noise", p.accelerometer_noise, {0.0, 100.0}, "m/s^2", Presence::optional);
  v.field("gyro_bias", p.gyro_bias, {0.0, 1.0}, "rad/s", Presence::optional);
  v.field("gyro_bias_time", p.gyro_bias_time, {1.0, 1e6}, "s", Presence::optional);
  v.field("vibration_x", p.vibration_x, {0.0, 100.0}, "m/s^2", Presence::optional);
  v.field("vibration_y", p.vibration_y, {0.0, 100.0}, "m/s^2", Presence::optional);
  v.field("vibration_z", p.vibration_z, {0.0, 100.0}, "m/s^2", Presence::optional);
  v.field("vibration_gyro", p.vibration_gyro, {0.0, 10.0}, "rad/s", Presence::optional);
  v.field("vibration_time", p.vibration_time, {0.0, 10.0}, "s", Presence::optional);
  v.field("stamp_jitter", p.stamp_jitter, {0.0, 1.0}, "s", Presence::optional);
  v.field("network_delay", p.network_delay, {0.0, 1.0}, "s", Presence::optional);
  v.field("seed", p.seed, "", Presence::optional);
}

}  // namespace jackal_aic::sim
