#include "closed_loop.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "jackal_aic/parameter_map.hpp"
#include "jackal_aic/skid_steer_kinematics.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kShortestResponse = 0.6;  // s; the final value is a mean over 0.5 s
constexpr double kTimeTolerance = 1e-9;    // s

void require(bool condition, const char* name, double value, const char* bound) {
  if (condition) return;
  std::ostringstream message;
  message << name << " = " << value << ": must be " << bound;
  throw ParameterError(message.str());
}

BodyVector trueVelocity(const PlantTruth& truth, Support support, const SkidSteerKinematics& kinematics) {
  if (support == Support::ground)
    return {truth.linear_velocity.x(), truth.linear_velocity.y(), truth.angular_velocity.z()};
  const auto& wheel = truth.wheel_velocity;
  return kinematics.bodyVelocity(
      {0.5 * (wheel[kFrontLeft] + wheel[kRearLeft]), 0.5 * (wheel[kFrontRight] + wheel[kRearRight])});
}

/// One channel of the loop: what is wanted, what is true, what is believed.
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

}  // namespace

SetPoint SetPointProfile::at(double time) const {
  SetPoint now;
  for (const Change& change : changes) {
    if (change.time <= time + kTimeTolerance) now = change.set_point;
  }
  return now;
}

SetPointProfile stepProfile(double forward, double yaw_rate, double duration) {
  require(std::isfinite(forward) && std::isfinite(yaw_rate) && (forward != 0.0 || yaw_rate != 0.0), "step", forward,
          "finite and not zero, unless there is a turn");
  require(duration >= kShortestResponse && duration <= 3600.0, "duration", duration, "in [0.6, 3600] s");
  SetPointProfile profile;
  profile.changes = {{kRestTime, SetPoint{forward, 0.0, yaw_rate}}};
  profile.duration = kRestTime + duration;
  profile.assessed_from = kRestTime;
  profile.assessed_until = profile.duration;
  return profile;
}

SetPointProfile squareProfile(const SquareWave& wave) {
  require(std::isfinite(wave.low) && std::isfinite(wave.high) && wave.high != wave.low, "max", wave.high,
          "finite and different from min");
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

std::vector<Sample> runClosedLoop(JackalPlant& plant, TimedController& controller, const SetPointProfile& profile,
                                  Support support, const GeometryParameters& geometry) {
  const auto steps = std::llround(profile.duration / JackalPlant::kStep);
  std::vector<Sample> samples;
  samples.reserve(static_cast<std::size_t>(steps));
  const SkidSteerKinematics kinematics(geometry);
  BodyVector measured = BodyVector::Zero();
  WheelCommand command;
  for (long long k = 0; k < steps; ++k, plant.step()) {
    const double now = plant.time();
    const SetPoint set_point = profile.at(now);
    controller.setSetPoint(set_point);
    if (plant.measurement()) {
      const Observation y = plant.measurement()->observation();
      measured = kinematics.bodyVelocity({y.wheel_left, y.wheel_right});
      measured(kYaw) = y.yaw_rate;
      controller.observe(y);
    }
    if (const auto due = controller.advance(now)) {
      command = *due;
      plant.command(command);
    }
    const BodyVector velocity = trueVelocity(plant.truth(), support, kinematics);
    samples.push_back({now, set_point, velocity(kForward), velocity(kYaw), measured(kForward), measured(kYaw),
                       controller.belief(), command});
  }
  return samples;
}

ResponseMetrics assess(const std::vector<Sample>& samples, const SetPointProfile& profile) {
  const SetPoint before = profile.at(profile.assessed_from - JackalPlant::kStep);
  const SetPoint after = profile.at(profile.assessed_from);
  const BodyChannel which = after.forward != before.forward ? kForward : kYaw;
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
    diverged.stable = false;
    return diverged;
  }
  return stepResponseMetrics(time, value, profile.assessed_from, initial, target);
}

}  // namespace jackal_aic::sim
