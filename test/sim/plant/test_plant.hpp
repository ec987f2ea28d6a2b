#pragma once

/// @file
/// What the tests of the plant share.

#include <cmath>
#include <stdexcept>
#include <string>

#include "../../repository.hpp"
#include "jackal_plant.hpp"

namespace jackal_aic::sim {

/// Geometry of the published Jackal, which the URDF has to reproduce.
constexpr double kWheelRadius = 0.098;  // m
constexpr double kTrack = 0.37559;      // m
constexpr double kGravity = 9.81;       // m/s^2

/// The Jackal's URDF with the first occurrence of a text replaced.
inline std::string jackalUrdfWith(const std::string& original, const std::string& replacement) {
  std::string text = jackalUrdf();
  const auto position = text.find(original);
  if (position == std::string::npos) throw std::runtime_error("not in the URDF: " + original);
  return text.replace(position, original.size(), replacement);
}

/// Known dead time and lag, no noise: the tests do not depend on the calibration of the defaults.
inline PlantParameters quiet() {
  PlantParameters parameters;
  parameters.dead_time = 0.11;
  parameters.motor_lag = 0.035;
  parameters.velocity_loop_integral = 0.0;
  parameters.acceleration_limit = 25.0;
  parameters.noise_scale = 0.0;
  return parameters;
}

/// Without noise, dead time or lag: the wheels follow their commands at once.
inline PlantParameters direct() {
  PlantParameters parameters = quiet();
  parameters.dead_time = 0.0;
  parameters.motor_lag = 0.0;
  return parameters;
}

/// Steps for a number of seconds.
inline void run(JackalPlant& plant, double duration) {
  for (long n = std::lround(duration / JackalPlant::kStep); n > 0; --n) plant.step();
}

/// Steps until the next sample is there.
inline PlantMeasurement nextMeasurement(JackalPlant& plant) {
  do {
    plant.step();
  } while (!plant.measurement());
  return *plant.measurement();
}

/// Both sides at a speed of the wheel circumference [m/s].
inline WheelCommand rolling(double left, double right) { return {left / kWheelRadius, right / kWheelRadius}; }

}  // namespace jackal_aic::sim
