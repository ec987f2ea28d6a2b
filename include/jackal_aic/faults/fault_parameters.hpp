#pragma once

/// @file
/// Parameters of the fault detection (fault_monitor.hpp).

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/model/sensor_noise.hpp"

namespace jackal_aic {

/// Parameters of the fault detection. YAML prefix `faults`; the least variances of the measurements have `sensors`.
struct FaultParameters : SensorNoise {
  double false_alarm_rate = 0.04;     ///< alpha: bound of the rate of outliers among good samples, for any distribution
  int frozen_samples = 8;             ///< equal values in a row that make a sensor frozen; 0 switches this test off
  double recovery_time = 1.0;         ///< time of good samples after which a faulty channel counts again [s]
  double dead_time_deviation = 0.03;  ///< standard deviation of the plant's dead time [s]
  double gain_deviation = 0.1;        ///< standard deviation of the plant's gain, relative
  double slowest_acceleration = 0.5;  ///< of the plant, in multiples of its model's acceleration limit
  double fastest_acceleration = 3.0;  ///< of the plant, in multiples of its model's acceleration limit
  double slip_deviation = 0.2;        ///< standard deviation of 1/b_hat, relative, after a change of speed by 0.5 m/s
  double largest_bias = 0.05;         ///< of the gyro; a larger one is a fault [rad/s]
};

/// Lists the fields of FaultParameters, but for the variances, with unit and range.
template <class Visitor>
void describeFields(Visitor& v, FaultParameters& p) {
  v.field("false_alarm_rate", p.false_alarm_rate, {1e-4, 0.2}, "", Presence::optional);
  v.field("frozen_samples", p.frozen_samples, {0, 1000}, "", Presence::optional);
  v.field("recovery_time", p.recovery_time, {0.0, 60.0}, "s", Presence::optional);
  v.field("dead_time_deviation", p.dead_time_deviation, {0.0, 0.2}, "s", Presence::optional);
  v.field("gain_deviation", p.gain_deviation, {0.0, 1.0}, "", Presence::optional);
  v.field("slowest_acceleration", p.slowest_acceleration, {0.01, 1.0}, "", Presence::optional);
  v.field("fastest_acceleration", p.fastest_acceleration, {1.0, 100.0}, "", Presence::optional);
  v.field("slip_deviation", p.slip_deviation, {0.0, 1.0}, "", Presence::optional);
  v.field("largest_bias", p.largest_bias, {1e-4, 10.0}, "rad/s", Presence::optional);
}

}  // namespace jackal_aic
