#pragma once

/// @file
/// Bodies of the simulated robot, and their ground.

#include <Eigen/Geometry>
#include <cstddef>

namespace jackal_aic::sim {

/// Motion of the chassis' centre of mass; vectors in the ground frame.
struct ChassisState {
  Eigen::Vector3d position;              ///< [m]
  Eigen::Quaterniond orientation;        ///< base_link in the ground frame
  Eigen::Vector3d velocity;              ///< [m/s]
  Eigen::Vector3d angular_velocity;      ///< [rad/s]
  Eigen::Vector3d acceleration;          ///< mean over the last step [m/s^2]
  Eigen::Vector3d angular_acceleration;  ///< mean over the last step [rad/s^2]
};

/// Chassis and four wheels whose motors turn them at given speeds.
class World {
 public:
  World() = default;
  virtual ~World() = default;
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// Sets the speed that a wheel's motor reaches in the next step, if its torque suffices [rad/s].
  virtual void setWheelReference(std::size_t wheel, double speed) = 0;

  /// Changes the friction coefficient.
  virtual void setFriction(double friction) = 0;

  /// Applies a force at the chassis' centre of mass [N] and a torque about its vertical [N m], both in the chassis'
  /// frame, from now on.
  virtual void push(const Eigen::Vector3d& force, double torque) = 0;

  /// Lifts the robot with a turn, or sets it down again. Not on a box.
  virtual void lift(bool lifted) = 0;

  /// Advances by a time step [s].
  virtual void step(double step) = 0;

  /// Motion of the chassis after the last step.
  virtual ChassisState chassis() const = 0;

  /// Speed of a wheel relative to the chassis [rad/s].
  virtual double wheelSpeed(std::size_t wheel) const = 0;

  /// Torque of a wheel's motor in the last step [N m].
  virtual double wheelTorque(std::size_t wheel) const = 0;

  /// Gravity in the ground frame [m/s^2].
  virtual const Eigen::Vector3d& gravity() const = 0;
};

}  // namespace jackal_aic::sim
