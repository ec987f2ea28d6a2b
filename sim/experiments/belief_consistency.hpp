#pragma once

/// @file
/// Whether a belief's covariance is that of its errors: normalised estimation error squared (NEES), e' P^-1 e.

#include <array>
#include <cstdint>
#include <string>

#include "jackal_aic/odometry/dead_reckoning.hpp"
#include "loop_setup.hpp"

namespace jackal_aic::sim {

/// x_dot [m/s] and theta_dot [rad/s] as they are, or on the box as the wheels have them.
Eigen::Vector2d trueMotion(const LoopSetup& setup, const PlantTruth& truth);

/// Sums of normalised squared errors of (x_dot, theta_dot).
struct ConsistencySums {
  /// Takes e' P^-1 e of a motion and its covariance.
  void add(const PlanarMotion& motion, const Eigen::Vector2d& truth);
  void add(const ConsistencySums& other);  ///< takes all of another

  double nees() const { return total / samples; }           ///< mean; 2 for a covariance that is right
  double forwardNees() const { return forward / samples; }  ///< mean of the forward speed alone; likewise 1
  double yawNees() const { return yaw / samples; }          ///< of the yaw rate alone; likewise 1
  double inside() const { return within / samples; }        ///< part of the samples within the 95 % bounds

  double total = 0.0;    ///< sum of e' P^-1 e
  double forward = 0.0;  ///< sum of e_x^2 / P_xx
  double yaw = 0.0;      ///< sum of e_yaw^2 / P_yaw
  double within = 0.0;   ///< samples within the 95 % bounds of a chi-squared with 2 degrees of freedom
  double samples = 0.0;  ///< that were taken
};

/// What a robot is doing, by its set point.
enum class DrivePhase {
  standing,  ///< zero for kUnsteadyTime
  steady,    ///< another one for as long
  transient  ///< before that
};

/// Names of the phases, by DrivePhase.
inline constexpr std::array<const char*, 3> kPhaseNames{"standing", "steady", "transient"};

/// Time after a change of the set point that counts as transient [s].
inline constexpr double kUnsteadyTime = 1.5;

/// Sums of each phase, by DrivePhase.
using PhaseConsistency = std::array<ConsistencySums, 3>;

/// Drives the predictive controller through set points drawn from a seed, each followed by a stop, and compares the
/// velocity that it publishes with the true one. @param plant as loadSetup(), or `drawn`: the robot of the plant `real`
/// that drawReality() draws from the seed, of which the controller is told nothing.
PhaseConsistency driveConsistency(const PackageFiles& files, const std::string& plant, std::uint64_t seed);

/// Drives all plants with kConsistencySeeds seeds each, and writes belief.csv into a directory. @param jobs threads; 0:
/// one per core.
void writeConsistencyTable(const PackageFiles& files, const std::string& directory, unsigned jobs);

/// Drives on each plant in the table.
inline constexpr std::size_t kConsistencySeeds = 20;

}  // namespace jackal_aic::sim
