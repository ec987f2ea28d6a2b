#pragma once

/// @file
/// Faults of the robot's sensors, put into samples of the simulated robot. No physics engine here: a fault of the drive
/// train (a blocked motor) is JackalPlant::blockWheels().

#include <limits>
#include <vector>

#include "jackal_plant.hpp"

namespace jackal_aic::sim {

/// What a faulty sensor does.
enum class SensorFaultKind {
  encoder_freeze,  ///< the encoder of a side repeats its last sample, to the bit
  encoder_value,   ///< the encoder of a side reads `value` [rad/s]
  encoder_offset,  ///< the encoder of a side reads `value` too much [rad/s]
  gyro_freeze,     ///< the gyro repeats its last sample, to the bit
  gyro_offset,     ///< the yaw rate reads `value` too much [rad/s]
  imu_flip         ///< the IMU hangs upside down: turned by half a turn about its x axis
};

/// One fault over a span of time. A span shorter than two samples is an outlier, some samples a burst.
struct SensorFault {
  SensorFaultKind kind;
  Side side = Side::left;                                  ///< of an encoder
  double value = 0.0;                                      ///< see the kinds
  double from = 0.0;                                       ///< first stamp with the fault [s]
  double until = std::numeric_limits<double>::infinity();  ///< stamp without it again [s]
};

/// Passes samples on with the faults in them.
class SensorFaults {
 public:
  explicit SensorFaults(std::vector<SensorFault> faults) : faults_(std::move(faults)) {}

  /// The sample as a robot with these faults would give it. Call it with every sample, in order of time: a frozen
  /// sensor repeats what was passed on last.
  PlantMeasurement apply(const PlantMeasurement& sample);

 private:
  std::vector<SensorFault> faults_;
  PlantMeasurement last_{};
  bool has_last_ = false;
};

}  // namespace jackal_aic::sim
