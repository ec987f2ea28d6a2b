#pragma once

/// @file
/// Encoders and IMU of the simulated robot, with seeded noise. No physics engine here.

#include <Eigen/Geometry>
#include <array>
#include <deque>
#include <optional>
#include <random>

#include "jackal_plant.hpp"

namespace jackal_aic::sim {

/// What the sensors are exposed to at the moment of a sample, free of noise.
struct SensorInput {
  std::array<double, 4> wheel_effort;  ///< [N m]
  Eigen::Vector3d angular_velocity;    ///< of imu_link, in imu_link [rad/s]
  Eigen::Vector3d specific_force;      ///< acceleration minus gravity at the origin of imu_link, in imu_link [m/s^2]
                                       ///< averaged since the last sample, as an IMU does against aliasing
  Eigen::Quaterniond orientation;      ///< imu_link in a level frame
};

/// Samples the sensors, adds noise and loses samples. The rear encoders copy the front ones, as on the robot, which
/// has one motor with one encoder per side. A wheel speed gets its noise and is then rounded to whole `encoder_step`.
class SensorModel {
 public:
  /// @param parameters noise, resolution and seed.
  explicit SensorModel(const PlantParameters& parameters);

  /// One sample with fresh noise. @param truth with the wheel speeds as the encoders see them (EncoderFilter).
  PlantMeasurement sample(const PlantTruth& truth, const SensorInput& input);

  /// Draws whether a sample gets lost on its way (rate `measurement_loss`); to be asked once per sample. The first
  /// never is. The noise does not depend on what gets lost.
  bool losesSample();

  /// Delay of a sample on its way [s], drawn between 0 and `stamp_jitter`; none for the first.
  double drawDelay();

 private:
  double noise(double deviation);
  Eigen::Vector3d noiseVector(double deviation);

  PlantParameters parameters_;
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
  std::mt19937_64 loss_generator_;
  std::mt19937_64 delay_generator_;
  bool first_ = true;
  bool first_delay_ = true;
};

/// Low-pass in the measured wheel speeds: dw_f/dt = (w - w_f) / T, exact for a constant w.
class EncoderFilter {
 public:
  /// @param time_constant T [s], 0 lets the speed through; @param step of the simulation [s].
  EncoderFilter(double time_constant, double step);

  /// Takes the true speeds after a step. @returns w_f [rad/s].
  const std::array<double, 4>& update(const std::array<double, 4>& wheel_velocity);

 private:
  double kept_;  // exp(-step/T): part of the difference that a step leaves
  std::array<double, 4> filtered_{};
};

/// Samples on their way to whoever reads them: each comes, in order, at the time it is stamped with.
class SampleQueue {
 public:
  /// Sends a sample. @param stamp time at which it is to come [s]; not before those sent earlier.
  void send(const PlantMeasurement& sample, double stamp);

  /// The sample that comes at this time [s]; at most one per call.
  std::optional<PlantMeasurement> receive(double time);

 private:
  std::deque<PlantMeasurement> underway_;
};

}  // namespace jackal_aic::sim
