#pragma once

/// @file
/// What a belief gains that knows, or learns, that the noise of its sensors has a memory.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "package_files.hpp"

namespace jackal_aic::sim {

/// Noise on top of that of the simulated sensors.
struct AddedNoise {
  const char* name;  ///< its colour
  bool smooth;       ///< of Gaussian autocorrelation exp(-t^2/(4 s^2)), else exp(-|t|/T)
  double time;       ///< s or T [s]; 0: white
  double wheel;      ///< standard deviation, each encoder [rad/s]
  double gyro;       ///< standard deviation [rad/s]
};

/// What an estimator made of a robot's drives under a noise.
struct EstimatorFigures {
  std::string name;             ///< of the estimator
  double forward = 0.0;         ///< error of the forward speed, root mean square [m/s]
  double yaw_rate = 0.0;        ///< of the yaw rate, likewise [rad/s]
  Eigen::Vector2d wheel_noise;  ///< learned of the left encoder: deviation [rad/s] and s or T [s]; geometric means
  Eigen::Vector2d gyro_noise;   ///< likewise of the gyro
};

/// Estimators, in the order of what follows.
enum class Estimator { shipped, precision_learned, taken_for_white, known, smoothness_learned, whitened };

/// Drives the robot on a plant by predictive (driving cycles of two minutes, segments of 3 to 6 s), adds the noise to
/// what its encoders and its gyro measured, and lets every estimator believe the motion from that and from the
/// commands. Errors are those of the second minute. @param plant box, ground or real; @param seeds number of drives.
std::vector<EstimatorFigures> estimateUnderNoise(const PackageFiles& files, const std::string& plant,
                                                 const AddedNoise& noise, std::size_t seeds);

/// Every estimator on every plant under noises of six colours and two sizes, four drives each; writes
/// coloured_noise.csv into a directory. @param jobs threads; 0: one per core.
void writeColouredNoiseTable(const PackageFiles& files, const std::string& directory, unsigned jobs);

}  // namespace jackal_aic::sim
