#pragma once

/// @file
/// Encoders and IMU of the simulated robot, with seeded noise. No physics engine here.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <random>

#include "jackal_plant.hpp"

namespace jackal_aic::sim {

/// True quantities at the moment of a sample, free of noise.
struct SensorInput {
  std::array<double, 4> wheel_effort;  ///< [N m]
  Eigen::Vector3d angular_velocity;    ///< of imu_link, in imu_link [rad/s]
  Eigen::Vector3d specific_force;      ///< acceleration minus gravity at the origin of imu_link, in imu_link [m/s^2]
                                       ///< averaged since the last sample, as an IMU does against aliasing
  Eigen::Quaterniond orientation;      ///< imu_link in a level frame
};

/// Correlated random numbers of deviation 1: Ornstein-Uhlenbeck processes of one correlation time, exact at any
/// distance in time, and stationary from the start.
class ColouredNoise {
 public:
  static constexpr int kChannels = 6;
  using Values = Eigen::Matrix<double, kChannels, 1>;

  /// @param correlation_time T of exp(-|t| / T) [s], 0 makes them white; @param seed.
  ColouredNoise(double correlation_time, std::uint64_t seed);

  /// Values at a time [s], not before that of the last call.
  const Values& at(double time);

 private:
  double correlation_time_;
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
  std::optional<double> time_;
  Values values_ = Values::Zero();
};

/// The message of a sample.
enum class SampleMessage {
  joint_states,  ///< with the IMU's part, unless the IMU has its own rate
  imu            ///< of an IMU with its own rate
};

/// Samples the sensors, adds noise and loses samples. The rear encoders copy the front ones, because the robot has one
/// motor with one encoder per side. A wheel speed gets its noise and is then rounded to whole `encoder_step`. The IMU's
/// vibration is proportional to the circumferential speed of the faster wheels, and coloured; its gyro's bias wanders.
class SensorModel {
 public:
  /// @param parameters noise, resolution and seed; @param wheel_radius of the left and right wheels [m].
  explicit SensorModel(const PlantParameters& parameters, const std::array<double, 2>& wheel_radius = {0.098, 0.098});

  /// The wheels' part of a sample, with fresh noise. @param truth with the wheel speeds behind the encoders' low-pass.
  WheelFeedback wheels(const PlantTruth& truth, const SensorInput& input);

  /// The IMU's part of a sample, which is drawn after the wheels'.
  ImuMeasurement imu(const PlantTruth& truth, const SensorInput& input);

  /// Draws whether a sample repeats the last one (rate `feedback_repeats`); to be called once per sample. The first
  /// never does.
  bool repeatsFeedback();

  /// Time that a message is underway [s], drawn between 0 and `network_delay`; to be called once per message.
  double drawTravel();

  /// Draws whether a sample is lost (rate `measurement_loss`); to be called once per sample. The first never is. Noise,
  /// losses and messages are independent.
  bool losesSample(SampleMessage message = SampleMessage::joint_states);

  /// Delay of a sample on its way [s], drawn between 0 and `stamp_jitter`; none for the first.
  double drawDelay(SampleMessage message = SampleMessage::joint_states);

 private:
  /// Delay and loss of the samples of a message.
  struct Way {
    explicit Way(std::uint64_t seed);

    std::mt19937_64 losses, delays;
    bool first = true, first_delay = true;
  };

  Way& wayOf(SampleMessage message) { return message == SampleMessage::imu ? imu_way_ : way_; }
  double noise(double deviation);
  Eigen::Vector3d noiseVector(double deviation);

  PlantParameters parameters_;
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
  Way way_;
  Way imu_way_;
  std::mt19937_64 repeat_generator_;
  std::mt19937_64 travel_generator_;
  ColouredNoise vibration_;
  ColouredNoise bias_;
  std::array<double, 2> wheel_radius_;
  bool first_repeat_ = true;
};

/// Samples on their way to their reader: each is stamped at its sending and arrives later, in order.
/// @tparam Sample has a `stamp` [s].
template <class Sample = PlantMeasurement>
class SampleQueue {
 public:
  /// Sends a sample. @param stamp time of sending [s], or that of the one sent before if that is later; @param travel
  /// time underway [s]; a sample without travel is stamped with its arrival.
  void send(const Sample& sample, double stamp, double travel = 0.0) {
    Message message{sample, stamp + travel, travel > 0.0};
    message.sample.stamp = stamp;
    if (!underway_.empty()) {
      message.sample.stamp = std::max(stamp, underway_.back().sample.stamp);
      message.arrival = std::max({message.arrival, message.sample.stamp, underway_.back().arrival});
    }
    underway_.push_back(message);
  }

  /// The sample that arrives at this time [s]; at most one per call.
  std::optional<Sample> receive(double time) {
    if (underway_.empty() || underway_.front().arrival > time) return std::nullopt;
    Sample sample = underway_.front().sample;
    if (!underway_.front().travels) sample.stamp = time;
    underway_.pop_front();
    return sample;
  }

 private:
  struct Message {
    Sample sample;
    double arrival;  // [s]
    bool travels;
  };
  std::deque<Message> underway_;
};

}  // namespace jackal_aic::sim
