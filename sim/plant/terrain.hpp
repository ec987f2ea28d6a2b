#pragma once

/// @file
/// The ground of the simulated robot: its height, its friction and a kerb or wall on it. No physics engine here.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "plant_parameters.hpp"

namespace jackal_aic::sim {

/// The ground under a point.
struct Surface {
  double height = 0.0;                                ///< z [m]
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit vector out of the ground
};

/// Contact of a wheel.
struct TouchPoint {
  Eigen::Vector3d point;   ///< [m]
  Eigen::Vector3d normal;  ///< unit vector towards the wheel
  double depth;            ///< penetration of the wheel [m]; below zero: no contact
};

/// Height field of random waves in the ground frame (see JackalPlant), a ramp, squares of random friction and a kerb.
/// The random heights fade in over the first metre around the origin, so that the robot starts on the level. Equal
/// parameters give equal ground.
class Terrain {
 public:
  explicit Terrain(const PlantParameters& parameters);

  /// Height and normal at a place [m].
  Surface surface(double x, double y) const;

  /// Friction at a place in multiples of that of the whole ground.
  double frictionShare(double x, double y) const;

  /// Where a wheel, here a sphere, touches the kerb, whose top follows the ground; empty if the kerb is out of reach.
  /// @param hub [m]; @param radius [m].
  std::optional<TouchPoint> kerb(const Eigen::Vector3d& hub, double radius) const;

 private:
  /// One of the waves that the height is made of.
  struct Wave {
    double x, y;       ///< wave vector [rad/m]
    double phase;      ///< [rad]
    double amplitude;  ///< [m]
  };

  PlantParameters parameters_;
  double ramp_;  ///< slope of the ramp
  std::vector<Wave> waves_;
};

}  // namespace jackal_aic::sim
