#include "sensor_faults.hpp"

#include <array>
#include <limits>

namespace jackal_aic::sim {
namespace {

std::array<Wheel, 2> wheelsOf(Side side) {
  if (side == Side::left) return {kFrontLeft, kRearLeft};
  return {kFrontRight, kRearRight};
}

/// A value with a fault.
double faultyValue(FaultKind kind, double amount, double value) {
  switch (kind) {
    case FaultKind::not_a_number:
      return std::numeric_limits<double>::quiet_NaN();
    case FaultKind::infinite:
      return std::numeric_limits<double>::infinity();
    case FaultKind::set:
      return amount;
    case FaultKind::huge:
      return 1e300;
    case FaultKind::bias:
      return value + amount;
    case FaultKind::scale:
      return value * amount;
    default:
      return value;
  }
}

void flip(PlantMeasurement& sample) {
  const Eigen::Quaterniond half_turn(0.0, 1.0, 0.0, 0.0);  // about x; its own inverse
  sample.angular_velocity = half_turn * sample.angular_velocity;
  sample.linear_acceleration = half_turn * sample.linear_acceleration;
  sample.orientation = sample.orientation * half_turn;
}

void putEncoder(const SensorFault& fault, Side side, const PlantMeasurement& last, PlantMeasurement& sample) {
  for (Wheel wheel : wheelsOf(side)) {
    double& speed = sample.wheel_velocity[wheel];
    const bool frozen = fault.kind == FaultKind::freeze;
    if (frozen) sample.wheel_position[wheel] = last.wheel_position[wheel];
    speed = frozen ? last.wheel_velocity[wheel] : faultyValue(fault.kind, fault.amount, speed);
  }
}

void putGyro(const SensorFault& fault, const PlantMeasurement& last, PlantMeasurement& sample) {
  if (fault.kind == FaultKind::freeze) {
    sample.angular_velocity = last.angular_velocity;
    return;
  }
  double& yaw_rate = sample.angular_velocity.z();
  yaw_rate = faultyValue(fault.kind, fault.amount, yaw_rate);
}

void putAcceleration(const SensorFault& fault, const PlantMeasurement& last, PlantMeasurement& sample) {
  for (int axis = 0; axis < 3; ++axis) {
    double& value = sample.linear_acceleration(axis);
    value =
        fault.kind == FaultKind::freeze ? last.linear_acceleration(axis) : faultyValue(fault.kind, fault.amount, value);
  }
}

/// @param last sample passed on before this one.
void put(const SensorFault& fault, const PlantMeasurement& last, PlantMeasurement& sample) {
  if (fault.kind == FaultKind::upside_down) return flip(sample);
  const bool all = fault.channel == FaultChannel::all;
  if (all || fault.channel == FaultChannel::left) putEncoder(fault, Side::left, last, sample);
  if (all || fault.channel == FaultChannel::right) putEncoder(fault, Side::right, last, sample);
  if (all || fault.channel == FaultChannel::gyro) putGyro(fault, last, sample);
  if (fault.channel == FaultChannel::acceleration) putAcceleration(fault, last, sample);
}

}  // namespace

PlantMeasurement SensorFaults::apply(const PlantMeasurement& sample) {
  PlantMeasurement faulty = sample;
  if (!has_last_) last_ = sample;
  for (const SensorFault& fault : faults_) {
    if (fault.activeAt(sample.stamp)) put(fault, last_, faulty);
  }
  last_ = faulty;
  has_last_ = true;
  return faulty;
}

}  // namespace jackal_aic::sim
