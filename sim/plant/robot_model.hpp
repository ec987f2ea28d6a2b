#pragma once

/// @file
/// The robot for the physics engine, from a URDF: chassis, four wheels, pose of the IMU.

#include <Eigen/Geometry>
#include <array>
#include <string>

namespace jackal_aic::sim {

/// Mass properties of a rigid body, in base_link with all joints at zero.
struct RigidBody {
  double mass = 0.0;                                  ///< [kg]
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();   ///< centre of mass [m]
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< about the centre of mass, axes of base_link [kg m^2]

  /// Both bodies as one (parallel axis theorem).
  RigidBody operator+(const RigidBody& other) const;
};

/// A wheel that turns about +y of base_link.
struct WheelModel {
  RigidBody body;
  Eigen::Vector3d hub;  ///< joint origin in base_link [m]
  double radius;        ///< [m]
};

/// A skid-steer robot with four wheels.
struct RobotModel {
  RigidBody chassis;                 ///< everything that is not a wheel
  std::array<WheelModel, 4> wheels;  ///< in the order of Wheel
  Eigen::Isometry3d imu;             ///< imu_link in base_link
};

/// Reads the model. Links on fixed joints are lumped with their parent; joints other than the wheels' are held at zero.
/// @throws ParameterError (one line) if the text is not a URDF, or if base_link, imu_link or a wheel joint is missing.
/// Also if a wheel does not turn about +y of base_link or has no radius in the range of GeometryParameters. Also
/// for a mass beyond [0.001, 10000] kg, a principal inertia beyond [1e-9, 1e5] kg m^2, a centre of mass 100 m away.
RobotModel readRobotModel(const std::string& urdf_xml);

}  // namespace jackal_aic::sim
