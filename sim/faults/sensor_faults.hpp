#pragma once

/// @file
/// Faults of the robot's sensors, put into samples of the simulated robot. A fault of the drive train (a blocked motor)
/// is JackalPlant::blockWheels().

#include <utility>
#include <vector>

#include "injected_fault.hpp"
#include "jackal_plant.hpp"

namespace jackal_aic::sim {

/// Passes samples on with the faults in them.
class SensorFaults {
 public:
  /// @param faults of the channels left, right (encoders), gyro and acceleration (all axes, not part of `all`):
  /// FaultKind::freeze, to the bit, and those of values;
  /// FaultKind::upside_down turns the IMU by half a turn about its x axis. Their onset is the stamp 0.
  explicit SensorFaults(std::vector<InjectedFault> faults) : faults_(std::move(faults)) {}

  /// The sample as a robot with these faults would give it. Call it with every sample, in order of time: a frozen
  /// sensor repeats what was passed on last.
  PlantMeasurement apply(const PlantMeasurement& sample);

 private:
  std::vector<InjectedFault> faults_;
  PlantMeasurement last_{};
  bool has_last_ = false;
};

}  // namespace jackal_aic::sim
