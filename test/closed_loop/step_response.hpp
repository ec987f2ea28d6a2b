#pragma once

/// @file
/// Runs of the closed loop and the figures of one of their steps, as sim/lab/metrics.py has them.

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "closed_loop.hpp"
#include "loop_setup.hpp"
#include "response_metrics.hpp"

namespace jackal_aic::sim {

/// State of the loop after one step of the plant. Speeds of the body are in base_link.
struct Sample {
  double time;                             ///< [s]
  SetPoint set_point;                      ///< in force
  double velocity;                         ///< true forward speed [m/s]; on the box from the true wheel speeds
  double yaw_rate;                         ///< true yaw rate [rad/s]; on the box from the true wheel speeds
  double measured_velocity;                ///< from the last encoder sample, r (omega_L + omega_R)/2 [m/s]
  double measured_yaw_rate;                ///< last gyro sample [rad/s]
  std::optional<BodyVector> belief;        ///< of the controller
  WheelCommand command;                    ///< last command [rad/s]
  std::optional<Observation> observation;  ///< that the controller took in this step
};

/// driveClosedLoop() with one sample per step of the plant.
/// @param geometry r and b_hat for the speeds computed from the wheels.
inline std::vector<Sample> runClosedLoop(JackalPlant& plant, DriveLoop& drive, const SetPointProfile& profile,
                                         Support support, const GeometryParameters& geometry,
                                         const LoopParameters& loop = {}) {
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
    samples.push_back(
        {step.time, step.set_point, velocity(kForward), velocity(kYaw), measured(kForward), measured(kYaw),
         drive.controller().hasBelief() ? std::optional(drive.controller().believedVelocity()) : std::nullopt,
         step.command, step.observation});
  };
  driveClosedLoop(plant, drive, profile, hooks, loop);
  return samples;
}

/// A profile, and which of its steps is assessed.
struct AssessedProfile : SetPointProfile {
  double assessed_from = 0.0;                     ///< time of the step [s]
  double assessed_until = 0.0;                    ///< end of what is assessed [s]
  std::optional<BodyChannel> assessed{kForward};  ///< component whose step it is; empty if there is none
};

/// A step from rest for some time [s], assessed in the forward speed unless only the yaw rate steps.
inline AssessedProfile stepProfile(double forward, double yaw_rate, double duration) {
  AssessedProfile profile;
  profile.changes = {{kRestTime, SetPoint{forward, 0.0, yaw_rate}}};
  profile.duration = kRestTime + duration;
  profile.assessed_from = kRestTime;
  profile.assessed_until = profile.duration;
  profile.assessed = forward != 0.0 ? kForward : kYaw;
  return profile;
}

/// Figures of the assessed step. Without such a step, and if a belief runs away to more than ten times the largest set
/// point, which the limits of the command can hide from the velocity, none but `bounded`.
inline ResponseMetrics assess(const std::vector<Sample>& samples, const AssessedProfile& profile) {
  double largest = 0.0;
  for (const auto& change : profile.changes) {
    largest = std::max({largest, std::abs(change.set_point.forward), std::abs(change.set_point.yaw_rate)});
  }
  const auto keeps = [largest](const Sample& sample) {
    return !sample.belief || sample.belief->cwiseAbs().maxCoeff() <= 10.0 * largest;
  };
  ResponseMetrics metrics;
  metrics.bounded = std::all_of(samples.begin(), samples.end(), keeps);
  if (!profile.assessed || !metrics.bounded) return metrics;
  const bool turn = *profile.assessed == kYaw;
  std::vector<double> time, value;
  for (const Sample& sample : samples) {
    if (sample.time > profile.assessed_until + kTimeTolerance) break;
    time.push_back(sample.time);
    value.push_back(turn ? sample.yaw_rate : sample.velocity);
  }
  const SetPoint before = profile.at(profile.assessed_from - JackalPlant::kStep);
  const SetPoint after = profile.at(profile.assessed_from);
  return stepResponseMetrics(time, value, profile.assessed_from, turn ? before.yaw_rate : before.forward,
                             turn ? after.yaw_rate : after.forward);
}

/// A run and the figures of its assessed step.
struct RunResult {
  ResponseMetrics metrics;
  std::vector<Sample> samples;
};

/// Builds the loop of a setup, runs it along a profile and assesses it.
inline RunResult runSetup(const LoopSetup& setup, const AssessedProfile& profile) {
  JackalPlant plant(setup.urdf, setup.plant);
  DriveLoop drive = makeLoop(setup);
  auto samples = runClosedLoop(plant, drive, profile, setup.plant.support, setup.drive.geometry, setup.loop);
  const ResponseMetrics metrics = assess(samples, profile);
  return {metrics, std::move(samples)};
}

}  // namespace jackal_aic::sim
