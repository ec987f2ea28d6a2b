#pragma once

/// @file
/// Linear model of the driven robot: identification estimates it, the stability certificate and the predictive
/// controller use it.

#include <string>
#include <vector>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/model/geometry.hpp"

namespace jackal_aic {

/// Response of the wheel speeds to the drive command, per wheel, with command u, wheel speed w and target r:
///
///     lag dw/dt = r(t - dead_time) + z - w,    dz/dt = velocity_loop_integral (r(t - dead_time) - w),
///     r = sign(u) max(0, gain |u| - offset),
///
/// and of the yaw rate to the wheel speeds, theta_dot = wheel_radius slip_factor (w_R - w_L) / effective_track (3-1),
/// with wheel radius and slip factor of the robot's geometry (geometryOf()). Motors with an offset turn slower than
/// commanded by a fixed amount, and stand below it; some Jackals do so by 0.5 rad/s (clearpath_robot#280; DeadZone,
/// drive_train.hpp). YAML prefix `plant_model`. The defaults are the Jackal that config/jackal_model.yaml assumes, but
/// `identified` is true: a file without this key comes from an identification.
struct PlantModel {
  double dead_time = 0.08;              ///< from a command until the motors follow it, with all transports [s]
  double lag = 0.03;                    ///< time constant of the wheel speed [s]; 0 follows at once
  double gain = 1.0;                    ///< wheel speed / command at steady state, without the offset
  double offset = 0.0;                  ///< wheels turn slower than gain x command by this [rad/s]
  double velocity_loop_integral = 0.0;  ///< integral gain of the velocity loop [1/s]; 0: first-order lag
  double acceleration_limit = 1.65;     ///< of the wheel circumference, beyond the linear response [m/s^2]
  double effective_track = 0.0;         ///< b_hat [m]; 0: that of the controller
  bool on_box = false;                  ///< wheels free in the air, so that the gyro measures no turn (section 4-1)
  double sensor_rate = 50.0;            ///< of paired wheel and IMU samples [Hz]
  bool identified = true;               ///< measured on this robot; false: assumed before identification
  double dead_time_half_width = 0.0;    ///< half of the 95 % confidence interval of dead_time [s]; 0: unknown
  double lag_half_width = 0.0;          ///< the same for lag [s]
  double gain_half_width = 0.0;         ///< the same for gain
  double offset_half_width = 0.0;       ///< the same for offset [rad/s]
};

/// The geometry of the robot that a model describes, with the model's effective track if it has one.
inline GeometryParameters geometryOf(const PlantModel& model, GeometryParameters geometry) {
  if (model.effective_track > 0.0) geometry.effective_track = model.effective_track;
  return geometry;
}

/// The model to drive a robot with: its own if it was identified, else the middle of the possible robots. Dead time,
/// lag and gain minimise the largest spectral radius over robots of half to twice the assumed dead time and lag and a
/// gain of 0.8 to 1.2. It is 0.970 with the shipped gains, 0.985 with the assumed values, and above 1 with 1.5 times
/// their dead time and lag. The fault detection uses wider ranges (robot_range.hpp).
inline PlantModel drivenModel(PlantModel model) {
  if (model.identified) return model;
  model.dead_time *= 1.2;
  model.lag *= 1.2;
  model.gain *= 1.1;
  return model;
}

/// Lists the fields of PlantModel with unit and range, and the name of the robot, `robot` (see robotName()), which is
/// not part of the model.
template <class Visitor>
void describeFields(Visitor& v, PlantModel& p) {
  std::string robot;
  v.field("robot", robot, Presence::optional);
  v.field("dead_time", p.dead_time, {0.0, 2.0}, "s", Presence::required);
  v.field("lag", p.lag, {0.0, 2.0}, "s", Presence::required);
  v.field("gain", p.gain, {0.1, 3.0}, "", Presence::optional);
  v.field("offset", p.offset, {0.0, 5.0}, "rad/s", Presence::optional);
  v.field("velocity_loop_integral", p.velocity_loop_integral, {0.0, 100.0}, "1/s", Presence::optional);
  v.field("acceleration_limit", p.acceleration_limit, {0.01, 1000.0}, "m/s^2", Presence::optional);
  v.field("effective_track", p.effective_track, {0.0, 5.0}, "m", Presence::optional);
  v.field("on_box", p.on_box, Presence::optional);
  v.field("sensor_rate", p.sensor_rate, {1.0, 1000.0}, "Hz", Presence::optional);
  v.field("identified", p.identified, Presence::optional);
  v.field("dead_time_half_width", p.dead_time_half_width, {0.0, 2.0}, "s", Presence::optional);
  v.field("lag_half_width", p.lag_half_width, {0.0, 2.0}, "s", Presence::optional);
  v.field("gain_half_width", p.gain_half_width, {0.0, 3.0}, "", Presence::optional);
  v.field("offset_half_width", p.offset_half_width, {0.0, 5.0}, "rad/s", Presence::optional);
}

/// Reads plant_model.*. @throws ParameterError also if the effective track is neither 0 nor in the range of
/// GeometryParameters.
PlantModel readPlantModel(ParameterMap& map, const PlantModel& defaults = {});

/// The corners of the box that the confidence intervals of dead time, lag, gain and offset span, within the ranges of a
/// plant model; the model itself if it states no interval.
std::vector<PlantModel> confidenceBox(const PlantModel& model);

/// Name of the robot that a plant model describes (key plant_model.robot); empty without this key.
inline std::string robotName(ParameterMap& map) {
  std::string robot;
  ParameterReader(map, "plant_model").field("robot", robot, Presence::optional);
  return robot;
}

}  // namespace jackal_aic
