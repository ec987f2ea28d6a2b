#pragma once

/// @file
/// Faults of robot and sensors in the closed loop without ROS, and the fault monitor of its drive loop.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "closed_loop.hpp"
#include "jackal_aic/faults/fault_monitor.hpp"
#include "loop_setup.hpp"
#include "sensor_faults.hpp"

namespace jackal_aic::sim {

/// A motor that blocks over a span of time.
struct BlockedMotor {
  Side side;
  double from;   ///< [s]
  double until;  ///< [s]
};

/// Channels that are not measured over a span of time.
struct ChannelLoss {
  ChannelValidity remaining;  ///< channels still measured
  double from;                ///< [s]
  double until;               ///< [s]
};

/// A push over a span of time, a kerb if it is short; see JackalPlant::push().
struct Push {
  double forward;  ///< [N]
  double torque;   ///< [N m]
  double from;     ///< [s]
  double until;    ///< [s]
};

/// A span of time in which the robot is lifted.
struct Lift {
  double from;   ///< [s]
  double until;  ///< [s]
};

/// Faults in a run, and actions on the robot.
struct Faults {
  std::vector<SensorFault> sensors;  ///< their onset is the start of the run
  std::vector<BlockedMotor> motors;
  std::vector<ChannelLoss> losses;
  std::vector<Push> pushes;
  std::vector<Lift> lifts;
};

/// The model that a monitor of a plant uses: the drive train of the plant's file without offset and overrides, and the
/// effective track of config/plant_model.yaml.
PlantModel monitorModel(const PackageFiles& files, const std::string& plant_name);

/// The drive loop of a setup with the fault monitor, whose model may differ from the controller's.
DriveLoop monitoredLoop(const LoopSetup& setup, const PlantModel& model);

/// Hooks that inject faults into a robot and its sensors. @param plant the driven one; has to outlive the hooks.
LoopHooks faultHooks(JackalPlant& plant, const Faults& faults);

}  // namespace jackal_aic::sim
