#pragma once

/// @file
/// The closed loop without ROS with faults in the robot and the drive loop's own fault monitor.

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

/// State of the monitored loop after one sensor sample.
struct MonitoredSample {
  double time;              ///< [s]
  SetPoint set_point;       ///< in force
  double velocity;          ///< true forward speed [m/s]
  double yaw_rate;          ///< true yaw rate [rad/s]
  double wheel_left;        ///< true speed of the left wheels [rad/s]
  WheelCommand command;     ///< in force [rad/s]
  FaultReport report;       ///< of the monitor
  Fault fault;              ///< reported by the loop
  ChannelValidity counted;  ///< channels that reached the controller
};

/// The model that a monitor of a plant uses: the drive train of the plant's file without offset and overrides, and the
/// effective track of config/plant_model.yaml.
PlantModel monitorModel(const PackageFiles& files, const std::string& plant_name);

/// The drive loop of a setup with the fault monitor, whose model may differ from the controller's.
DriveLoop monitoredLoop(const LoopSetup& setup, const PlantModel& model);

/// Hooks that inject faults into a robot and its sensors. @param plant the driven one; has to outlive the hooks.
LoopHooks faultHooks(JackalPlant& plant, const Faults& faults);

/// Runs the drive loop of a setup along a profile with faults: outliers and faulty channels do not reach the
/// controller, and wheels that do not follow, or are moved, stop the robot. One sample per sample of the sensors.
/// @param model of the monitor.
std::vector<MonitoredSample> runMonitored(const LoopSetup& setup, const PlantModel& model,
                                          const SetPointProfile& profile, const Faults& faults);

/// As above, for long runs: passes each sample on instead of keeping it.
void runMonitored(const LoopSetup& setup, const PlantModel& model, const SetPointProfile& profile, const Faults& faults,
                  const std::function<void(const MonitoredSample&)>& take);

/// Time and name of a found fault.
struct Detection {
  double delay;        ///< from the fault to the report [s]
  std::string reason;  ///< FaultReport::reason()
};

/// First fault that is reported at or after a time [s]; empty if none is. @throws ParameterError if one was reported
/// before.
std::optional<Detection> detection(const std::vector<MonitoredSample>& samples, double from);

}  // namespace jackal_aic::sim
