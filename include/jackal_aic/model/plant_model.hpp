#pragma once

/// @file
/// Linear model of the driven robot as a controller sees it: what identification estimates, the stability certificate
/// certifies against and a predicting controller predicts with.

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
/// where the offset is that of motors which turn by a fixed amount slower than commanded, and not at all below it, as
/// those of some Jackals do by 0.5 rad/s (clearpath_robot#280; DeadZone, drive_train.hpp),
/// and of the yaw rate to the wheel speeds, theta_dot = wheel_radius slip_factor (w_R - w_L) / effective_track (3-1),
/// with wheel radius and slip factor of the robot's geometry (geometryOf()). YAML prefix `plant_model`. The defaults
/// are what config/jackal_model.yaml assumes of a Jackal, but for `identified`: a file that does not say was written by
/// somebody who knows the robot.
struct PlantModel {
  double dead_time = 0.08;              ///< from a command until the motors follow it, all transports included [s]
  double lag = 0.03;                    ///< time constant of the wheel speed [s]; 0 follows at once
  double gain = 1.0;                    ///< wheel speed / command at steady state; with an offset, change of both
  double offset = 0.0;                  ///< by which a wheel turns slower than gain x command [rad/s]; 0: none
  double velocity_loop_integral = 0.0;  ///< integral gain of the motors' velocity loop [1/s]; 0 is a first-order lag
  double acceleration_limit = 1.65;     ///< of the wheel circumference [m/s^2]; no part of the linear response
  double effective_track = 0.0;         ///< true virtual width b_hat [m]; 0 stands for the controller's own
  bool on_box = false;                  ///< wheels free, in the air: the gyro sees no turn (thesis section 4-1)
  double sensor_rate = 50.0;            ///< of paired wheel and IMU samples [Hz]
  bool identified = true;  ///< estimated from this robot; false: assumed of a robot that nobody has identified yet
  double dead_time_half_width =
      0.0;                         ///< half the width of the 95 % confidence interval of dead_time [s]; 0: not stated
  double lag_half_width = 0.0;     ///< likewise of lag [s]
  double gain_half_width = 0.0;    ///< likewise of gain
  double offset_half_width = 0.0;  ///< likewise of offset [rad/s]
};

/// The geometry of the robot that a model describes: with the model's effective track, if it has one.
inline GeometryParameters geometryOf(const PlantModel& model, GeometryParameters geometry) {
  if (model.effective_track > 0.0) geometry.effective_track = model.effective_track;
  return geometry;
}

/// Share of the assumed acceleration limit that is asked of a robot that nobody has identified, until its wheels have
/// followed: more than the motors follow winds up.
inline constexpr double kAskedShare = 0.5;

/// The model to drive a robot by: its own, or, if nobody has identified it, one from the middle of what it may be, with
/// the acceleration that is asked for at first. Dead time, lag and
/// gain are those for which the slowest spectral radius is smallest over robots of half to twice the assumed dead time
/// and lag and a gain of 0.8 to 1.2 (0.970 with the shipped gains; 0.985 with the assumed numbers themselves, above 1
/// with 1.5 times dead time and lag). What such a robot may do, which the fault detection asks, is another question.
inline PlantModel drivenModel(PlantModel model) {
  if (model.identified) return model;
  model.acceleration_limit *= kAskedShare;
  model.dead_time *= 1.2;
  model.lag *= 1.2;
  model.gain *= 1.1;
  return model;
}

/// The model to believe a wheel by that is driven by a model: what is not asked for is no limit of its motor. A belief
/// with that limit takes a ramp by which a weaker motor falls back for the limit, and never learns how weak it is.
inline PlantModel believedModel(PlantModel driven) {
  if (!driven.identified) driven.acceleration_limit /= kAskedShare;
  return driven;
}

/// Lists the fields of PlantModel with unit and range, and the name of the robot, `robot`, which a file has beside them
/// (see robotName()) and no computation needs.
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

/// Reads plant_model.*. @throws ParameterError also if the effective track is neither 0 nor one that a robot may have
/// (GeometryParameters).
PlantModel readPlantModel(ParameterMap& map, const PlantModel& defaults = {});

/// The corners of the box that the confidence intervals of dead time, lag, gain and offset span, none of them below
/// what a plant model may have; a model that states no interval is its only one.
std::vector<PlantModel> confidenceBox(const PlantModel& model);

/// Which robot a plant model describes, in its own words (key plant_model.robot); empty if it does not say.
inline std::string robotName(ParameterMap& map) {
  std::string robot;
  ParameterReader(map, "plant_model").field("robot", robot, Presence::optional);
  return robot;
}

}  // namespace jackal_aic
