#pragma once

/// @file
/// Noise of the robot's sensors.

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic {

/// Variances Sigma_y of the measurements. YAML prefix `sensors`. The predictive controller weighs the measurements by
/// them; for the fault detection they are lower bounds.
struct SensorNoise {
  double wheel_variance = 9e-4;            ///< of a measured wheel speed [(rad/s)^2]
  double gyro_variance = 2.5e-5;           ///< of the measured yaw rate [(rad/s)^2]
  double accelerometer_variance = 2.5e-3;  ///< of a measured acceleration [(m/s^2)^2]
};

/// Lists the fields of SensorNoise with unit and range.
template <class Visitor>
void describeFields(Visitor& v, SensorNoise& p) {
  v.field("wheel_variance", p.wheel_variance, {1e-9, 1e3}, "(rad/s)^2", Presence::optional);
  v.field("gyro_variance", p.gyro_variance, {1e-12, 1e3}, "(rad/s)^2", Presence::optional);
  v.field("accelerometer_variance", p.accelerometer_variance, {1e-12, 1e3}, "(m/s^2)^2", Presence::optional);
}

}  // namespace jackal_aic
