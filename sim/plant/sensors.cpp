#include "sensors.hpp"

#include <utility>

namespace jackal_aic::sim {

SensorModel::SensorModel(const PlantParameters& parameters) : parameters_(parameters), generator_(parameters.seed) {}

PlantMeasurement SensorModel::sample(const PlantTruth& truth, const SensorInput& input) {
  PlantMeasurement sample;
  sample.stamp = truth.time;
  sample.wheel_effort = input.wheel_effort;
  for (const auto& [front, rear] : {std::pair(kFrontLeft, kRearLeft), std::pair(kFrontRight, kRearRight)}) {
    sample.wheel_position[front] = truth.wheel_position[front];
    sample.wheel_velocity[front] = truth.wheel_velocity[front] + noise(parameters_.encoder_noise);
    sample.wheel_position[rear] = sample.wheel_position[front];
    sample.wheel_velocity[rear] = sample.wheel_velocity[front];
  }
  sample.angular_velocity = input.angular_velocity + noiseVector(parameters_.gyro_noise);
  sample.linear_acceleration = input.specific_force + noiseVector(parameters_.accelerometer_noise);
  sample.orientation = input.orientation;
  return sample;
}

double SensorModel::noise(double deviation) { return parameters_.noise_scale * deviation * normal_(generator_); }

Eigen::Vector3d SensorModel::noiseVector(double deviation) {
  Eigen::Vector3d vector;
  for (int i = 0; i < 3; ++i) vector[i] = noise(deviation);  // Eigen 3.3 has no begin()
  return vector;
}

}  // namespace jackal_aic::sim
