#pragma once

/// @file
/// Conversion between the parameters of the simulated robot and the controller's plant model.

#include "jackal_aic/model/plant_model.hpp"
#include "plant_parameters.hpp"

namespace jackal_aic::sim {

/// Model of a simulated robot's drive train. The effective track, which follows from friction and geometry, is that of
/// the controller.
inline PlantModel linearModel(const PlantParameters& plant) {
  PlantModel model;
  model.dead_time = plant.dead_time;
  model.lag = plant.motor_lag;
  model.gain = plant.wheel_gain;
  model.offset = plant.wheel_gain * plant.wheel_offset;  // the motor's is one of its command
  model.velocity_loop_integral = plant.velocity_loop_integral;
  model.acceleration_limit = plant.acceleration_limit;
  model.on_box = plant.support == Support::box;
  model.sensor_rate = plant.sensor_rate;
  return model;
}

/// The simulated robot of keys: plant.*, else plant_model.*, as `identify` writes them.
/// @throws ParameterError.
inline PlantParameters readSimulatedRobot(ParameterMap& map) {
  PlantParameters robot;
  if (map.hasSection("plant_model")) {
    const PlantModel model = readPlantModel(map);
    robot.dead_time = model.dead_time;
    robot.motor_lag = model.lag;
    robot.wheel_gain = model.gain;
    robot.wheel_offset = model.offset / model.gain;
    robot.velocity_loop_integral = model.velocity_loop_integral;
    robot.acceleration_limit = model.acceleration_limit;
    robot.support = model.on_box ? Support::box : Support::ground;
    robot.sensor_rate = model.sensor_rate;
  }
  return readParameters<PlantParameters>(map, "plant", robot);
}

}  // namespace jackal_aic::sim
