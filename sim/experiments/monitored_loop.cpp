#include "monitored_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "plant_conversion.hpp"

namespace jackal_aic::sim {
namespace {

bool within(double time, double from, double until) {
  return time >= from - kTimeTolerance && time < until - kTimeTolerance;
}

bool blocked(const std::vector<BlockedMotor>& motors, Side side, double now) {
  for (const BlockedMotor& motor : motors) {
    if (motor.side == side && within(now, motor.from, motor.until)) return true;
  }
  return false;
}

/// What somebody does to the robot now.
void handle(JackalPlant& plant, const Faults& faults, double now) {
  for (Side side : {Side::left, Side::right}) plant.blockWheels(side, blocked(faults.motors, side, now));
  double forward = 0.0, torque = 0.0;
  for (const Push& push : faults.pushes) {
    if (!within(now, push.from, push.until)) continue;
    forward += push.forward;
    torque += push.torque;
  }
  plant.push(forward, 0.0, torque);
  plant.lift(std::any_of(faults.lifts.begin(), faults.lifts.end(),
                         [now](const Lift& lift) { return within(now, lift.from, lift.until); }));
}

ChannelValidity measured(const std::vector<ChannelLoss>& losses, double now) {
  ChannelValidity remaining;
  for (const ChannelLoss& loss : losses) {
    if (within(now, loss.from, loss.until)) remaining = remaining & loss.remaining;
  }
  return remaining;
}

/// The loop of a setup under the fault monitor, whose model need not be the controller's.
DriveLoop monitoredLoop(const DriveParameters& drive, const PlantModel& model) {
  DriveParameters monitored = drive;
  monitored.faults = FaultParameters{};
  monitored.plant_model = model;
  monitored.open_loop_monitored = true;
  return DriveLoop(monitored, makeController(drive, Divergence::allowed));
}

}  // namespace

PlantModel monitorModel(const PackageFiles& files, const std::string& plant_name) {
  PlantModel model = linearModel(loadSetup(files, "diff_drive", plant_name, {}).plant);
  model.offset = 0.0;  // as in loadSetup()
  ParameterMap map = files.configuration("plant_model");
  if (!model.on_box) model.effective_track = readPlantModel(map).effective_track;
  return model;
}

std::vector<MonitoredSample> runMonitored(const LoopSetup& setup, const PlantModel& model,
                                          const SetPointProfile& profile, const Faults& faults) {
  std::vector<MonitoredSample> samples;
  runMonitored(setup, model, profile, faults, [&samples](const MonitoredSample& sample) { samples.push_back(sample); });
  return samples;
}

void runMonitored(const LoopSetup& setup, const PlantModel& model, const SetPointProfile& profile, const Faults& faults,
                  const std::function<void(const MonitoredSample&)>& take) {
  JackalPlant plant(setup.urdf, setup.plant);
  DriveLoop drive = monitoredLoop(setup.drive, model);
  SensorFaults sensors(faults.sensors);
  const std::int64_t steps = profile.plantSteps();
  for (std::int64_t k = 0; k < steps; ++k, plant.step()) {
    const double now = plant.time();
    const SetPoint set_point = profile.at(now);
    drive.setSetPoint(set_point, now);
    handle(plant, faults, now);
    if (plant.measurement()) {
      Observation y = sensors.apply(*plant.measurement()).observation();
      y.valid = measured(faults.losses, now);
      drive.observe(y, now);
      const FaultReport& report = *drive.faultReport();
      const PlantTruth& truth = plant.truth();
      take({now, set_point, truth.linear_velocity.x(), truth.angular_velocity.z(),
            0.5 * (truth.wheel_velocity[kFrontLeft] + truth.wheel_velocity[kRearLeft]), drive.command(), report,
            drive.status().fault, y.valid & report.valid()});
    }
    if (const auto due = drive.advance(now)) plant.command(*due);
  }
}

std::optional<Detection> detection(const std::vector<MonitoredSample>& samples, double from) {
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
