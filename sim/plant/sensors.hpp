#pragma once

/// @file
/// Encoders and IMU of the simulated robot, with seeded noise. No physics engine here.

#include <Eigen/Geometry>
#include <array>
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
/// has one motor with one encoder per side.
class SensorModel {
 public:
  /// @param parameters noise and seed.
  explicit SensorModel(const PlantParameters& parameters);

  /// One sample with fresh noise.
  PlantMeasurement sample(const PlantTruth& truth, const SensorInput& input);

  /// Draws whether a sample gets lost on its way (rate `measurement_loss`); to be asked once per sample. The first
  /// never is. The noise does not depend on what gets lost.
  bool losesSample();

 private:
  double noise(double deviation);
  Eigen::Vector3d noiseVector(double deviation);

  PlantParameters parameters_;
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
  std::mt19937_64 loss_generator_;
  bool first_ = true;
};

}  // namespace jackal_aic::sim
