#include "sensors.hpp"

#include <utility>

namespace jackal_aic::sim {
namespace {

/// Tells the seed of the losses from that of the noise, so that they are independent.
constexpr std::uint64_t kLossStream = 0x9e3779b97f4a7c15;

}  // namespace

SensorModel::SensorModel(const PlantParameters& parameters)
    : parameters_(parameters), generator_(parameters.seed), loss_generator_(parameters.seed + kLossStream) {}

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

bool SensorModel::losesSample() {
  if (std::exchange(first_, false)) return false;
  return std::bernoulli_distribution(parameters_.measurement_loss)(loss_generator_);
}

double SensorModel::noise(double deviation) { return parameters_.noise_scale * deviation * normal_(generator_); }

Eigen::Vector3d SensorModel::noiseVector(double deviation) {
  Eigen::Vector3d vector;
  for (int i = 0; i < 3; ++i) vector[i] = noise(deviation);  // Eigen 3.3 has no begin()
  return vector;
}

}  // namespace jackal_aic::sim
