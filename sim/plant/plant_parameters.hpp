#pragma once

/// @file
/// Parameters of the simulated Jackal. Everything geometric and inertial comes from the URDF instead.

#include <array>
#include <cstdint>

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic::sim {

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
  double velocity_loop_integral = 0.678;  ///< integral gain of the velocity loop on (gain x command - speed) [1/s]
  double acceleration_limit = 1.65;       ///< of the wheel circumference under the velocity loop [m/s^2]
  double speed_limit = 2.5;               ///< of the wheel circumference, the robot's maximum [m/s]
  double torque_limit = 20.0;             ///< largest torque per wheel [N m]
  double payload = 0.0;                   ///< extra mass on the chassis, at its centre of mass [kg]
  double friction = 0.5;                  ///< Coulomb coefficient between wheels and ground
  double slope = 0.0;                 ///< inclination of the ground, positive is uphill along the initial heading [deg]
  double sensor_rate = 50.0;          ///< rate of encoders and IMU [Hz]
  double measurement_loss = 0.0;      ///< share of the samples (encoders and IMU together) that get lost, at random
  double noise_scale = 1.0;           ///< factor on all noise below; 0 switches it off
  double encoder_noise = 0.03;        ///< standard deviation of the wheel speed [rad/s]
  double encoder_step = 0.0;          ///< resolution of the measured wheel speed [rad/s]; 0: none
  double encoder_filter = 0.0;        ///< time constant of the low-pass in the measured wheel speed [s]; 0: none
  double gyro_noise = 0.005;          ///< standard deviation of the angular velocity [rad/s]
  double accelerometer_noise = 0.05;  ///< standard deviation of the acceleration [m/s^2]
  double stamp_jitter = 0.0;          ///< longest time by which a sample comes, and is stamped, late, at random [s]
  std::uint64_t seed = 1;             ///< of noise, losses and jitter
};

/// Lists the fields of PlantParameters with unit and range.
template <class Visitor>
void describeFields(Visitor& v, PlantParameters& p) {
  v.field("support", p.support, kSupportNames, Presence::optional);
  v.field("dead_time", p.dead_time, {0.0, 2.0}, "s", Presence::optional);
  v.field("motor_lag", p.motor_lag, {0.0, 2.0}, "s", Presence::optional);
  v.field("wheel_gain", p.wheel_gain, {0.1, 3.0}, "", Presence::optional);
  v.field("velocity_loop_integral", p.velocity_loop_integral, {0.0, 100.0}, "1/s", Presence::optional);
  v.field("acceleration_limit", p.acceleration_limit, {0.1, 1000.0}, "m/s^2", Presence::optional);
  v.field("speed_limit", p.speed_limit, {0.01, 100.0}, "m/s", Presence::optional);
  v.field("torque_limit", p.torque_limit, {0.1, 1000.0}, "N m", Presence::optional);
  v.field("payload", p.payload, {0.0, 100.0}, "kg", Presence::optional);
  v.field("friction", p.friction, {0.0, 5.0}, "", Presence::optional);
  v.field("slope", p.slope, {-45.0, 45.0}, "deg", Presence::optional);
  v.field("sensor_rate", p.sensor_rate, {1.0, 1000.0}, "Hz", Presence::optional);
  v.field("measurement_loss", p.measurement_loss, {0.0, 1.0}, "", Presence::optional);
  v.field("noise_scale", p.noise_scale, {0.0, 1000.0}, "", Presence::optional);
  v.field("encoder_noise", p.encoder_noise, {0.0, 10.0}, "rad/s", Presence::optional);
  v.field("encoder_step", p.encoder_step, {0.0, 10.0}, "rad/s", Presence::optional);
  v.field("encoder_filter", p.encoder_filter, {0.0, 10.0}, "s", Presence::optional);
  v.field("gyro_noise", p.gyro_noise, {0.0, 10.0}, "rad/s", Presence::optional);
  v.field("accelerometer_noise", p.accelerometer_noise, {0.0, 100.0}, "m/s^2", Presence::optional);
  v.field("stamp_jitter", p.stamp_jitter, {0.0, 1.0}, "s", Presence::optional);
  v.field("seed", p.seed, "", Presence::optional);
}

}  // namespace jackal_aic::sim
