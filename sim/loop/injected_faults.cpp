#include "injected_faults.hpp"

#include <algorithm>
#include <utility>

namespace jackal_aic::sim {
namespace {

constexpr std::pair<Side, FaultChannel> kSides[] = {{Side::left, FaultChannel::left},
                                                    {Side::right, FaultChannel::right}};

/// A value with a fault. @param last the value of the sample before.
double faultyValue(const InjectedFault& fault, double value, double last) {
  switch (fault.kind) {
    case FaultKind::freeze:
      return last;
    case FaultKind::not_a_number:
      return std::numeric_limits<double>::quiet_NaN();
    case FaultKind::infinite:
      return std::numeric_limits<double>::infinity();
    case FaultKind::set:
      return fault.value;
    case FaultKind::huge:
      return 1e300;
    case FaultKind::bias:
      return value + fault.value;
    case FaultKind::scale:
      return value * fault.value;
    default:
      return value;
  }
}

void turnOver(PlantMeasurement& sample) {
  const Eigen::Quaterniond half_turn(0.0, 1.0, 0.0, 0.0);  // about x; its own inverse
  sample.angular_velocity = half_turn * sample.angular_velocity;
  sample.linear_acceleration = half_turn * sample.linear_acceleration;
  sample.orientation = sample.orientation * half_turn;
}

/// @param last sample passed on before this one.
void put(const InjectedFault& fault, const PlantMeasurement& last, PlantMeasurement& sample) {
  if (fault.kind == FaultKind::upside_down) return turnOver(sample);
  const bool frozen = fault.kind == FaultKind::freeze;
  for (const Wheel wheel : {kFrontLeft, kRearLeft, kFrontRight, kRearRight}) {
    const bool left = wheel == kFrontLeft || wheel == kRearLeft;
    if (!fault.concerns(left ? FaultChannel::left : FaultChannel::right)) continue;
    double& speed = sample.wheel_velocity[wheel];
    speed = faultyValue(fault, speed, last.wheel_velocity[wheel]);
    if (frozen) sample.wheel_position[wheel] = last.wheel_position[wheel];
  }
  for (int axis = 0; axis < 3; ++axis) {
    double& rate = sample.angular_velocity(axis);
    const bool measured = axis == 2 || frozen;  // the gyro freezes as a whole
    if (measured && fault.concerns(FaultChannel::gyro)) rate = faultyValue(fault, rate, last.angular_velocity(axis));
    double& acceleration = sample.linear_acceleration(axis);
    if (fault.channel != FaultChannel::acceleration) continue;
    acceleration = faultyValue(fault, acceleration, last.linear_acceleration(axis));
  }
}

}  // namespace

FaultInjector::FaultInjector(Faults faults, const PlantParameters& plant)
    : faults_(std::move(faults)), gain_(plant.wheel_gain), offset_(plant.wheel_offset) {
  std::stable_sort(faults_.begin(), faults_.end(),
                   [](const InjectedFault& a, const InjectedFault& b) { return a.start < b.start; });
}

void FaultInjector::disturb(JackalPlant& plant, double now) {
  bool blocked[] = {false, false}, lifted = false;
  double forward = 0.0, torque = 0.0;
  for (const InjectedFault& fault : faults_) {
    if (!fault.activeAt(now)) continue;
    for (const auto& [side, channel] : kSides) {
      if (fault.kind == FaultKind::blocked && fault.concerns(channel)) blocked[static_cast<int>(side)] = true;
    }
    if (fault.kind == FaultKind::push) (fault.channel == FaultChannel::forward ? forward : torque) += fault.value;
    if (fault.kind == FaultKind::lift) lifted = true;
    if (fault.kind == FaultKind::friction) plant.setFriction(fault.value);
    if (fault.kind == FaultKind::gain) plant.changeMotors(gain_ = fault.value, offset_);
    if (fault.kind == FaultKind::offset) plant.changeMotors(gain_, offset_ = fault.value);
  }
  for (const auto& [side, channel] : kSides) plant.blockWheels(side, blocked[static_cast<int>(side)]);
  plant.push(forward, 0.0, torque);
  plant.lift(lifted);
}

PlantMeasurement FaultInjector::falsified(const PlantMeasurement& sample) {
  PlantMeasurement faulty = sample;
  for (const InjectedFault& fault : faults_) {
    if (fault.kind <= FaultKind::upside_down && fault.activeAt(sample.stamp))
      put(fault, last_.value_or(sample), faulty);
  }
  return *(last_ = faulty);
}

Observation FaultInjector::observed(const PlantMeasurement& sample, double now) {
  Observation observation = falsified(sample).observation();
  ChannelValidity& valid = observation.valid;
  for (const InjectedFault& fault : faults_) {
    if (fault.kind != FaultKind::lost || !fault.activeAt(now)) continue;
    valid.yaw_rate = valid.yaw_rate && !fault.concerns(FaultChannel::gyro);
    valid.wheel_left = valid.wheel_left && !fault.concerns(FaultChannel::left);
    valid.wheel_right = valid.wheel_right && !fault.concerns(FaultChannel::right);
    valid.acceleration = valid.acceleration && !fault.concerns(FaultChannel::acceleration);
  }
  return observation;
}

}  // namespace jackal_aic::sim
