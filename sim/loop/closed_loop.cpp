#include "closed_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kShortestResponse = 0.6;  // s; the final value is a mean over 0.5 s
constexpr double kFastest = 10.0;          // m/s, of a set point
constexpr double kFastestTurn = 50.0;      // rad/s

void require(bool condition, const char* name, double value, const char* bound) {
  if (!condition) throw ParameterError(fmt::format("{} = {:g}: must be {}", name, value, bound));
}

/// One channel of the loop: set point, true value, belief.
struct Channel {
  double set_point;
  double value;
  double belief;
};

Channel channel(const Sample& sample, BodyChannel which) {
  const double belief = sample.belief ? (*sample.belief)(which) : 0.0;
  if (which == kYaw) return {sample.set_point.yaw_rate, sample.yaw_rate, belief};
  return {sample.set_point.forward, sample.velocity, belief};
}

bool beliefRanAway(const std::vector<Sample>& samples, BodyChannel which) {
  double largest = 0.0;
  for (const Sample& sample : samples) largest = std::max(largest, std::abs(channel(sample, which).set_point));
  return std::any_of(samples.begin(), samples.end(), [&](const Sample& sample) {
    const double belief = channel(sample, which).belief;
    return !std::isfinite(belief) || std::abs(belief) > kRunaway * largest;
  });
}

/// Lets the plant rest for the time [s] that it is to be ahead of the controller; returns its time.
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

SetPointProfile stepProfile(double forward, double yaw_rate, double duration) {
  require(std::abs(forward) <= kFastest && (forward != 0.0 || yaw_rate != 0.0), "step", forward,
          "within +-10 m/s and not zero, unless there is a turn");
  require(std::abs(yaw_rate) <= kFastestTurn, "turn", yaw_rate, "within +-50 rad/s");
  require(duration >= kShortestResponse && duration <= 3600.0, "duration", duration, "in [0.6, 3600] s");
  SetPointProfile profile;
  profile.changes = {{kRestTime, SetPoint{forward, 0.0, yaw_rate}}};
  profile.duration = kRestTime + duration;
  profile.assessed_from = kRestTime;
  profile.assessed_until = profile.duration;
  profile.assessed = forward != 0.0 ? kForward : kYaw;
  return profile;
}

SetPointProfile squareProfile(const SquareWave& wave) {
  require(std::abs(wave.low) <= kFastest, "min", wave.low, "within +-10 m/s");
  require(std::abs(wave.high) <= kFastest && wave.high != wave.low, "max", wave.high,
          "within +-10 m/s and different from min");
  require(wave.period >= 2.0 * kShortestResponse && wave.period <= 3600.0, "period", wave.period, "in [1.2, 3600] s");
  require(wave.cycles >= 2 && wave.cycles <= 1000, "cycles", wave.cycles, "in [2, 1000]");
  SetPointProfile profile;
  const double half = 0.5 * wave.period;
  for (int i = 0; i < 2 * wave.cycles; ++i) {
    profile.changes.push_back({kRestTime + i * half, SetPoint{i % 2 == 0 ? wave.low : wave.high, 0.0, 0.0}});
  }
  profile.duration = kRestTime + wave.cycles * wave.period;
  profile.assessed_from = kRestTime + 3.0 * half;
  profile.assessed_until = profile.assessed_from + half;
  return profile;
}

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

ResponseMetrics assess(const std::vector<Sample>& samples, const SetPointProfile& profile, double settling_band) {
  const SetPoint before = profile.at(profile.assessed_from - JackalPlant::kStep);
  const SetPoint after = profile.at(profile.assessed_from);
  if (!profile.assessed) {
    ResponseMetrics metrics;
    metrics.bounded = !beliefRanAway(samples, kForward) && !beliefRanAway(samples, kYaw);
    return metrics;
  }
  const BodyChannel which = *profile.assessed;
  std::vector<double> time, value;
  for (const Sample& sample : samples) {
    if (sample.time > profile.assessed_until + kTimeTolerance) break;
    time.push_back(sample.time);
    value.push_back(channel(sample, which).value);
  }
  const double initial = which == kForward ? before.forward : before.yaw_rate;
  const double target = which == kForward ? after.forward : after.yaw_rate;
  if (beliefRanAway(samples, which)) {
    ResponseMetrics diverged;
    diverged.bounded = false;
    return diverged;
  }
  return stepResponseMetrics(time, value, profile.assessed_from, initial, target, settling_band);
}

}  // namespace jackal_aic::sim
