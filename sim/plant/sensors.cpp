#include "sensors.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace jackal_aic::sim {
namespace {

/// Tells the seed of the losses from that of the noise, so that they are independent.
constexpr std::uint64_t kLossStream = 0x9e3779b97f4a7c15;
constexpr std::uint64_t kDelayStream = 0xd1b54a32d192ed03;

double rounded(double value, double step) { return step > 0.0 ? step * std::round(value / step) : value; }

}  // namespace

SensorModel::SensorModel(const PlantParameters& parameters)
    : parameters_(parameters),
      generator_(parameters.seed),
      loss_generator_(parameters.seed + kLossStream),
      delay_generator_(parameters.seed + kDelayStream) {}

PlantMeasurement SensorModel::sample(const PlantTruth& truth, const SensorInput& input) {
  PlantMeasurement sample;
  sample.stamp = truth.time;
  sample.wheel_effort = input.wheel_effort;
  for (const auto& [front, rear] : {std::pair(kFrontLeft, kRearLeft), std::pair(kFrontRight, kRearRight)}) {
    sample.wheel_position[front] = truth.wheel_position[front];
    sample.wheel_velocity[front] =
        rounded(truth.wheel_velocity[front] + noise(parameters_.encoder_noise), parameters_.encoder_step);
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

double SensorModel::drawDelay() {
  if (std::exchange(first_delay_, false)) return 0.0;
  return std::uniform_real_distribution<double>(0.0, parameters_.stamp_jitter)(delay_generator_);
}

double SensorModel::noise(double deviation) { return parameters_.noise_scale * deviation * normal_(generator_); }

Eigen::Vector3d SensorModel::noiseVector(double deviation) {
  Eigen::Vector3d vector;
  for (int i = 0; i < 3; ++i) vector[i] = noise(deviation);  // Eigen 3.3 has no begin()
  return vector;
}

EncoderFilter::EncoderFilter(double time_constant, double step)
    : kept_(time_constant > 0.0 ? std::exp(-step / time_constant) : 0.0) {}

const std::array<double, 4>& EncoderFilter::update(const std::array<double, 4>& wheel_velocity) {
  for (std::size_t i = 0; i < filtered_.size(); ++i) {
    filtered_[i] = wheel_velocity[i] + kept_ * (filtered_[i] - wheel_velocity[i]);
  }
  return filtered_;
}

void SampleQueue::send(const PlantMeasurement& sample, double stamp) {
  underway_.push_back(sample);
  const double before = underway_.size() > 1 ? underway_[underway_.size() - 2].stamp : stamp;
  underway_.back().stamp = std::max(stamp, before);
}

std::optional<PlantMeasurement> SampleQueue::receive(double time) {
  if (underway_.empty() || underway_.front().stamp > time) return std::nullopt;
  PlantMeasurement sample = underway_.front();
  underway_.pop_front();
  sample.stamp = time;
  return sample;
}

}  // namespace jackal_aic::sim
