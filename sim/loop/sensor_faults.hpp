#pragma once

/// @file
/// Faults of the robot's sensors, injected into samples of the simulated robot. A fault of the drive train (a blocked
/// motor) is JackalPlant::blockWheels().

#include <array>
#include <utility>
#include <vector>

#include "jackal_plant.hpp"

namespace jackal_aic::sim {

/// Kind of a sensor fault. The meaning of SensorFault::amount is in brackets, its unit that of the channel.
enum class FaultKind {
  freeze,        ///< the values stay those of the last good sample; the stamp is fresh
  not_a_number,  ///< the value is NaN
  infinite,      ///< the value is infinite
  set,           ///< the value is a constant [value]
  huge,          ///< the value is 1e300
  bias,          ///< a bias is added [value]
  scale,         ///< the value is multiplied [factor; -1 flips the sign]
  upside_down    ///< the IMU is turned over about its x axis
};

/// Words of FaultKind, in the order of the enumerators.
inline constexpr std::array<const char*, 8> kFaultKindNames{"freeze", "not_a_number", "infinite", "set",
                                                            "huge",   "bias",         "scale",    "upside_down"};

/// Values of a sample that a fault changes.
enum class FaultChannel {
  all,          ///< encoders and gyro
  left,         ///< encoders of the left wheels
  right,        ///< of the right wheels
  gyro,         ///< yaw rate
  acceleration  ///< all axes
};

/// Words of FaultChannel, in the order of the enumerators.
inline constexpr std::array<const char*, 5> kFaultChannelNames{"all", "left", "right", "gyro", "acceleration"};

/// A fault of one sensor, for a time.
struct SensorFault {
  FaultKind kind;
  FaultChannel channel = FaultChannel::all;
  double amount = 0.0;    ///< meaning and unit depend on the kind
  double start = 0.0;     ///< [s]
  double duration = 1.6;  ///< [s]

  /// True at a time [s].
  bool activeAt(double time) const { return time >= start && time < start + duration; }
};

/// Injects faults into samples.
class SensorFaults {
 public:
  explicit SensorFaults(std::vector<SensorFault> faults) : faults_(std::move(faults)) {}

  /// The sample of a robot with these faults. Call it with every sample, in order of time, because a frozen sensor
  /// repeats the last one.
  PlantMeasurement apply(const PlantMeasurement& sample);

 private:
  std::vector<SensorFault> faults_;
  PlantMeasurement last_{};
  bool has_last_ = false;
};

}  // namespace jackal_aic::sim
