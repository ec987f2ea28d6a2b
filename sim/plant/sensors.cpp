#include "sensors.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace jackal_aic::sim {
namespace {

/// Separates the seed of the losses from that of the noise, so that they are independent.
constexpr std::uint64_t kLossStream = 0x9e3779b97f4a7c15;
constexpr std::uint64_t kDelayStream = 0xd1b54a32d192ed03;
constexpr std::uint64_t kImuStream = 0xe7037ed1a0b428db;
constexpr std::uint64_t kRepeatStream = 0x8cb92ba72f3d8dd7;
constexpr std::uint64_t kTravelStream = 0xdb4f0b9175ae2165;
constexpr std::uint64_t kVibrationStream = 0xbbe0563303a4615f;
constexpr std::uint64_t kBiasStream = 0xa0f2ec75a1fe1575;

double rounded(double value, double step) { return step > 0.0 ? step * std::round(value / step) : value; }

}  // namespace

ColouredNoise::ColouredNoise(double correlation_time, std::uint64_t seed)
    : correlation_time_(correlation_time), generator_(seed) {}

const ColouredNoise::Values& ColouredNoise::at(double time) {
  const bool goes_on = time_.has_value() && correlation_time_ > 0.0;
  const double kept = goes_on ? std::exp(-(time - *time_) / correlation_time_) : 0.0;
  const double fresh = std::sqrt(1.0 - kept * kept);
  for (int i = 0; i < kChannels; ++i) values_[i] = kept * values_[i] + fresh * normal_(generator_);
  time_ = time;
  return values_;
}

SensorModel::Way::Way(std::uint64_t seed) : losses(seed + kLossStream), delays(seed + kDelayStream) {}

SensorModel::SensorModel(const PlantParameters& parameters, const std::array<double, 2>& wheel_radius)
    : parameters_(parameters),
      generator_(parameters.seed),
      way_(parameters.seed),
      imu_way_(parameters.seed + kImuStream),
      repeat_generator_(parameters.seed + kRepeatStream),
      travel_generator_(parameters.seed + kTravelStream),
      vibration_(parameters.vibration_time, parameters.seed + kVibrationStream),
      bias_(parameters.gyro_bias_time, parameters.seed + kBiasStream),
      wheel_radius_(wheel_radius) {}

WheelFeedback SensorModel::wheels(const PlantTruth& truth, const SensorInput& input) {
  WheelFeedback sample;
  sample.feedback_stamp = truth.time;
  sample.wheel_effort = input.wheel_effort;
  for (const auto& [front, rear] : {std::pair(kFrontLeft, kRearLeft), std::pair(kFrontRight, kRearRight)}) {
    sample.wheel_position[front] = truth.wheel_position[front];
    sample.wheel_velocity[front] =
        rounded(truth.wheel_velocity[front] + noise(parameters_.encoder_noise), parameters_.encoder_step);
    sample.wheel_position[rear] = sample.wheel_position[front];
    sample.wheel_velocity[rear] = sample.wheel_velocity[front];
  }
  return sample;
}

ImuMeasurement SensorModel::imu(const PlantTruth& truth, const SensorInput& input) {
  ImuMeasurement sample;
  sample.stamp = truth.time;
  sample.angular_velocity = input.angular_velocity + noiseVector(parameters_.gyro_noise);
  sample.linear_acceleration = input.specific_force + noiseVector(parameters_.accelerometer_noise);
  sample.orientation = input.orientation;

  const PlantParameters& p = parameters_;
  if (p.vibration_x > 0.0 || p.vibration_y > 0.0 || p.vibration_z > 0.0 || p.vibration_gyro > 0.0) {
    const ColouredNoise::Values& shaking = vibration_.at(truth.time);
    const double rolling = std::max(wheel_radius_[0] * std::abs(truth.wheel_velocity[kFrontLeft]),
                                    wheel_radius_[1] * std::abs(truth.wheel_velocity[kFrontRight]));  // m/s
    const double scale = p.noise_scale * rolling;
    const Eigen::Vector3d deviation(p.vibration_x, p.vibration_y, p.vibration_z);
    sample.linear_acceleration += scale * deviation.cwiseProduct(shaking.head<3>());
    sample.angular_velocity += scale * p.vibration_gyro * shaking.tail<3>();
  }
  if (p.gyro_bias > 0.0) sample.angular_velocity += p.noise_scale * p.gyro_bias * bias_.at(truth.time).head<3>();
  return sample;
}

bool SensorModel::repeatsFeedback() {
  if (std::exchange(first_repeat_, false)) return false;
  return std::bernoulli_distribution(parameters_.feedback_repeats)(repeat_generator_);
}

double SensorModel::drawTravel() {
  return std::uniform_real_distribution<double>(0.0, parameters_.network_delay)(travel_generator_);
}

bool SensorModel::losesSample(SampleMessage message) {
  Way& way = wayOf(message);
  if (std::exchange(way.first, false)) return false;
  return std::bernoulli_distribution(parameters_.measurement_loss)(way.losses);
}

double SensorModel::drawDelay(SampleMessage message) {
  Way& way = wayOf(message);
  if (std::exchange(way.first_delay, false)) return 0.0;
  return std::uniform_real_distribution<double>(0.0, parameters_.stamp_jitter)(way.delays);
}

double SensorModel::noise(double deviation) { return parameters_.noise_scale * deviation * normal_(generator_); }

Eigen::Vector3d SensorModel::noiseVector(double deviation) {
  Eigen::Vector3d vector;
  for (int i = 0; i < 3; ++i) vector[i] = noise(deviation);  // Eigen 3.3 has no begin()
  return vector;
}

}  // namespace jackal_aic::sim
