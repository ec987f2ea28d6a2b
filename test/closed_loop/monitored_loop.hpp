#pragma once

/// @file
/// Runs of the closed loop with faults and a fault monitor, sample by sample.

#include <fmt/format.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "injected_faults.hpp"
#include "loop_setup.hpp"

namespace jackal_aic::sim {

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

/// Runs the drive loop of a setup along a profile with faults, and passes a sample on per sample of the sensors:
/// outliers and faulty channels do not reach the controller, and wheels that do not follow, or are moved, stop the
/// robot.
/// @param model of the monitor.
inline void runMonitored(const LoopSetup& setup, const PlantModel& model, const SetPointProfile& profile,
                         const Faults& faults, const std::function<void(const MonitoredSample&)>& take) {
  JackalPlant plant(setup.urdf, setup.plant);
  DriveLoop drive = monitoredLoop(setup, model);
  LoopHooks hooks = faultHooks(plant, faults);
  hooks.sensed = [&](const LoopStep& step) {
    const FaultReport& report = *drive.faultReport();
    const PlantTruth& truth = plant.truth();
    take({step.time, step.set_point, truth.linear_velocity.x(), truth.angular_velocity.z(),
          0.5 * (truth.wheel_velocity[kFrontLeft] + truth.wheel_velocity[kRearLeft]), drive.command(), report,
          drive.status().fault, step.observation->valid & report.valid()});
  };
  driveClosedLoop(plant, drive, profile, hooks);
}

/// The same samples, kept.
inline std::vector<MonitoredSample> runMonitored(const LoopSetup& setup, const PlantModel& model,
                                                 const SetPointProfile& profile, const Faults& faults) {
  std::vector<MonitoredSample> samples;
  runMonitored(setup, model, profile, faults, [&samples](const MonitoredSample& sample) { samples.push_back(sample); });
  return samples;
}

/// Time and name of a found fault.
struct Detection {
  double delay;        ///< from the fault to the report [s]
  std::string reason;  ///< FaultReport::reason()
};

/// First fault that is reported at or after a time [s]; empty if none is. @throws ParameterError if one was reported
/// before.
inline std::optional<Detection> detection(const std::vector<MonitoredSample>& samples, double from) {
  for (const MonitoredSample& sample : samples) {
    if (!sample.report.faulty()) continue;
    if (sample.time < from - kTimeTolerance) {
      throw ParameterError(
          fmt::format("fault reported before there is one: {} at {:.6f} s", sample.report.reason(), sample.time));
    }
    return Detection{sample.time - from, sample.report.reason()};
  }
  return std::nullopt;
}

}  // namespace jackal_aic::sim
