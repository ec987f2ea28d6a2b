#pragma once

/// @file
/// The ground of the simulated robot: its height, its friction and a kerb or wall on it. No physics engine here.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

namespace jackal_aic::sim {

/// Shape and friction of the ground; zeros make it a plane. Lengths in the ground frame (see JackalPlant).
struct TerrainParameters {
  double roughness = 0.0;         ///< root mean square of the height [m]
  double roughness_length = 1.0;  ///< middle wavelength of the height [m]
  double ramp = 0.0;              ///< inclination of a ramp across the x axis, positive is uphill [rad]
  double ramp_start = 0.0;        ///< x at which it begins [m]
  double ramp_length = 1.0;       ///< after which the ground is level again [m]
  double patch_size = 1.0;        ///< side of the squares that differ in friction [m]
  double patch_friction = 1.0;    ///< of the slipperiest square / friction; 1: equal
  double kerb_distance = 0.0;     ///< x of a kerb's edge, which has no end [m]; 0: none
  double kerb_height = 0.0;       ///< above the ground [m]; a wall if above the hubs
  std::uint64_t seed = 1;         ///< of height and patches
};

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

/// Height field of random waves, a ramp, squares of random friction and a kerb. The random heights fade in over the
/// first metre around the origin, so that the robot starts on the level. Equal parameters give equal ground.
class Terrain {
 public:
  explicit Terrain(const TerrainParameters& parameters);

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

  TerrainParameters parameters_;
  std::vector<Wave> waves_;
};

}  // namespace jackal_aic::sim
