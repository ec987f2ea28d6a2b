#include "sensor_faults.hpp"

#include <array>

namespace jackal_aic::sim {
namespace {

std::array<Wheel, 2> wheelsOf(Side side) {
  if (side == Side::left) return {kFrontLeft, kRearLeft};
  return {kFrontRight, kRearRight};
}

void flip(PlantMeasurement& sample) {
  const Eigen::Quaterniond half_turn(0.0, 1.0, 0.0, 0.0);  // about x; its own inverse
  sample.angular_velocity = half_turn * sample.angular_velocity;
  sample.linear_acceleration = half_turn * sample.linear_acceleration;
  sample.orientation = sample.orientation * half_turn;
}

/// @param last what was passed on before this sample.
void put(const SensorFault& fault, const PlantMeasurement& last, PlantMeasurement& sample) {
  switch (fault.kind) {
    case SensorFaultKind::encoder_freeze:
      for (Wheel wheel : wheelsOf(fault.side)) {
        sample.wheel_position[wheel] = last.wheel_position[wheel];
        sample.wheel_velocity[wheel] = last.wheel_velocity[wheel];
      }
      break;
    case SensorFaultKind::encoder_value:
      for (Wheel wheel : wheelsOf(fault.side)) sample.wheel_velocity[wheel] = fault.value;
      break;
    case SensorFaultKind::encoder_offset:
      for (Wheel wheel : wheelsOf(fault.side)) sample.wheel_velocity[wheel] += fault.value;
      break;
    case SensorFaultKind::gyro_freeze:
      sample.angular_velocity = last.angular_velocity;
      break;
    case SensorFaultKind::gyro_offset:
      sample.angular_velocity.z() += fault.value;
      break;
    case SensorFaultKind::imu_flip:
      flip(sample);
      break;
  }
}

}  // namespace

PlantMeasurement SensorFaults::apply(const PlantMeasurement& sample) {
  PlantMeasurement faulty = sample;
  if (!has_last_) last_ = sample;
  for (const SensorFault& fault : faults_) {
    if (sample.stamp >= fault.from && sample.stamp < fault.until) put(fault, last_, faulty);
  }
  last_ = faulty;
  has_last_ = true;
  return faulty;
}

}  // namespace jackal_aic::sim
