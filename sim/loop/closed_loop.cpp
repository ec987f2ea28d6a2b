#include "closed_loop.hpp"

#include <cmath>
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

std::optional<BodyVector> beliefOf(const VelocityController& controller) {
  return controller.hasBelief() ? std::optional(controller.believedVelocity()) : std::nullopt;
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
  auto friction = profile.friction_changes.begin();
  auto motor = profile.motor_changes.begin();
  for (std::int64_t k = 0; k < steps; ++k, plant.step()) {
    const double now = plant.time() - ahead;
    const SetPoint set_point = profile.at(now);
    drive.setSetPoint(set_point, now);
    for (; friction != profile.friction_changes.end() && friction->time <= now + kTimeTolerance; ++friction) {
      plant.setFriction(friction->friction);
    }
    for (; motor != profile.motor_changes.end() && motor->time <= now + kTimeTolerance; ++motor) {
      plant.changeMotors(motor->gain, motor->offset);
    }
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

std::vector<Sample> runClosedLoop(JackalPlant& plant, DriveLoop& drive, const SetPointProfile& profile, Support support,
                                  const GeometryParameters& geometry, const LoopParameters& loop) {
  std::vector<Sample> samples;
  samples.reserve(static_cast<std::size_t>(profile.plantSteps()));
  const SkidSteerKinematics kinematics(geometry);
  BodyVector measured = BodyVector::Zero();
  LoopHooks hooks;
  hooks.done = [&](const LoopStep& step) {
    if (step.observation) {
      measured = kinematics.bodyVelocity({step.observation->wheel_left, step.observation->wheel_right});
      measured(kYaw) = step.observation->yaw_rate;
    }
    const BodyVector velocity = reportedVelocity(plant.truth(), support, kinematics);
    samples.push_back({step.time, step.set_point, velocity(kForward), velocity(kYaw), measured(kForward),
                       measured(kYaw), beliefOf(drive.controller()), step.command, step.observation});
  };
  driveClosedLoop(plant, drive, profile, hooks, loop);
  return samples;
}

}  // namespace jackal_aic::sim
