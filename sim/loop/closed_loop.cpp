#include "closed_loop.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace jackal_aic::sim {
namespace {

/// Lets the plant rest for its lead over the controller [s]; returns its time.
double takeLead(JackalPlant& plant, DriveLoop& drive, double phase) {
  for (auto steps = std::llround(phase / JackalPlant::kStep); steps > 0; --steps) {
    if (plant.measurement()) drive.observe(plant.measurement()->observation(), plant.time() - phase);
    plant.step();
  }
  return plant.time();
}

}  // namespace

DriveParameters uninterrupted() {
  DriveParameters parameters;
  parameters.gate.deadlines = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  parameters.gate.plausibility.speed_factor = std::numeric_limits<double>::infinity();
  parameters.on_loss = {LossAction::drive, LossAction::drive, LossAction::drive,
                        std::numeric_limits<double>::infinity()};
  parameters.faults.reset();
  return parameters;
}

SetPoint SetPointProfile::at(double time) const {
  const auto later = std::upper_bound(changes.begin(), changes.end(), time + kTimeTolerance,
                                      [](double end, const Change& change) { return end < change.time; });
  return later == changes.begin() ? SetPoint{} : std::prev(later)->set_point;
}

std::int64_t SetPointProfile::plantSteps() const { return std::llround(duration / JackalPlant::kStep); }

BodyVector reportedVelocity(const PlantTruth& truth, Support support, const SkidSteerKinematics& kinematics) {
  if (support == Support::ground)
    return {truth.linear_velocity.x(), truth.linear_velocity.y(), truth.angular_velocity.z()};
  const auto& wheel = truth.wheel_velocity;
  return kinematics.bodyVelocity(
      {0.5 * (wheel[kFrontLeft] + wheel[kRearLeft]), 0.5 * (wheel[kFrontRight] + wheel[kRearRight])});
}

void driveClosedLoop(JackalPlant& plant, DriveLoop& drive, const SetPointProfile& profile, const LoopHooks& hooks,
                     const LoopParameters& loop) {
  const double ahead = takeLead(plant, drive, loop.phase);
  const std::int64_t steps = profile.plantSteps();
  WheelCommand command;
  for (std::int64_t k = 0; k < steps; ++k, plant.step()) {
    const double now = plant.time() - ahead;
    const SetPoint set_point = profile.at(now);
    drive.setSetPoint(set_point, now);
    if (hooks.disturb) hooks.disturb(now);
    std::optional<Observation> observation;
    if (const auto& sample = plant.measurement()) {
      observation = hooks.measure ? hooks.measure(*sample, now) : sample->observation();
      drive.observe(*observation, now);
      if (hooks.sensed) hooks.sensed({now, set_point, observation, command});
    }
    if (const auto due = drive.advance(now)) {
      command = *due;
      plant.command(command);
    }
    if (hooks.done) hooks.done({now, set_point, observation, command});
  }
}

}  // namespace jackal_aic::sim
