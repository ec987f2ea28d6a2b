#pragma once

/// @file
/// Faults of robot and sensors in the closed loop without ROS.

#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "jackal_plant.hpp"

namespace jackal_aic::sim {

/// Rounding of times that are multiples of a step [s].
inline constexpr double kTimeTolerance = 1e-9;

/// Kind of a fault, or of what is done to the robot. In brackets the meaning of InjectedFault::value.
enum class FaultKind {
  freeze,        ///< a sensor repeats its last good value with fresh stamps
  not_a_number,  ///< a sensor reads NaN
  infinite,      ///< a sensor reads infinity
  set,           ///< a sensor reads a constant [value]
  huge,          ///< a sensor reads 1e300
  bias,          ///< a bias is added to a sensor [value]
  scale,         ///< a sensor is multiplied [factor; -1 flips the sign]
  upside_down,   ///< the IMU is turned over about its x axis
  lost,          ///< a channel is not measured
  blocked,       ///< the motor of a side is blocked
  push,          ///< the robot is pushed [N, or N m about its vertical]; a kerb if it is short
  lift,          ///< the robot is lifted
  friction,      ///< another friction coefficient of the ground, for good [value]
  gain,          ///< another gain of the motors, for good [value]
  offset         ///< another offset of the motors, for good [rad/s]
};

/// Words of FaultKind, in the order of the enumerators.
inline constexpr std::array<const char*, 15> kFaultKindNames{"freeze", "not_a_number", "infinite",    "set",  "huge",
                                                             "bias",   "scale",        "upside_down", "lost", "blocked",
                                                             "push",   "lift",         "friction",    "gain", "offset"};

/// What a fault changes. `all` are encoders and gyro, of a loss every channel, of a block both sides.
enum class FaultChannel { all, left, right, gyro, acceleration, forward, yaw_rate };

/// Words of FaultChannel, in the order of the enumerators.
inline constexpr std::array<const char*, 7> kFaultChannelNames{"all",          "left",    "right",   "gyro",
                                                               "acceleration", "forward", "yaw_rate"};

/// A fault, for a time.
struct InjectedFault {
  FaultKind kind;
  FaultChannel channel = FaultChannel::all;
  double value = 0.0;                                         ///< meaning and unit depend on kind and channel
  double start = 0.0;                                         ///< [s]
  double duration = std::numeric_limits<double>::infinity();  ///< [s]

  /// True at a time [s].
  bool activeAt(double time) const {
    return time >= start - kTimeTolerance && time < start + duration - kTimeTolerance;
  }

  /// True of a channel that it names, or that `all` includes.
  bool concerns(FaultChannel one) const { return channel == FaultChannel::all || channel == one; }
};

using Faults = std::vector<InjectedFault>;

/// Injects faults into a robot and its samples.
class FaultInjector {
 public:
  /// @param plant parameters of the robot, whose motors a `gain` or an `offset` changes.
  FaultInjector(Faults faults, const PlantParameters& plant);

  /// Changes the robot in a step. @param now [s].
  void disturb(JackalPlant& plant, double now);

  /// The sample as a robot with these faults measures it. Call it with every sample, in order of time, because a
  /// frozen sensor repeats the last one.
  PlantMeasurement falsified(const PlantMeasurement& sample);

  /// What the drive loop receives of a sample, with the channels that are measured at a time [s].
  Observation observed(const PlantMeasurement& sample, double now);

 private:
  Faults faults_;  // in order of their start
  double gain_, offset_;
  std::optional<PlantMeasurement> last_;
};

}  // namespace jackal_aic::sim
