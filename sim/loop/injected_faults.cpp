#include "injected_faults.hpp"

#include <algorithm>

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

/// The sum of the present changes of the robot.
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

}  // namespace

PlantModel monitorModel(const PackageFiles& files, const std::string& plant_name) {
  PlantModel model = linearModel(loadSetup(files, "diff_drive", plant_name, {}).plant);
  model.offset = 0.0;  // as in loadSetup()
  ParameterMap map = files.configuration("plant_model");
  if (!model.on_box) model.effective_track = readPlantModel(map).effective_track;
  return model;
}

DriveLoop monitoredLoop(const LoopSetup& setup, const PlantModel& model) {
  DriveParameters monitored = setup.drive;
  monitored.faults = FaultParameters{};
  monitored.plant_model = model;
  monitored.open_loop_monitored = true;
  return DriveLoop(monitored, setup.structure ? setup.structure() : makeController(setup.drive, Divergence::allowed));
}

LoopHooks faultHooks(JackalPlant& plant, const Faults& faults) {
  LoopHooks hooks;
  hooks.disturb = [&plant, faults](double now) { handle(plant, faults, now); };
  hooks.measure = [sensors = SensorFaults(faults.sensors), losses = faults.losses](const PlantMeasurement& sample,
                                                                                   double now) mutable {
    Observation y = sensors.apply(sample).observation();
    y.valid = measured(losses, now);
    return y;
  };
  return hooks;
}

}  // namespace jackal_aic::sim
