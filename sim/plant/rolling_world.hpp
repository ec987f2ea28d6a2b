#pragma once

/// @file
/// A robot without masses: for where the rigid bodies make little difference and take nine tenths of the time.

#include <array>

#include "robot_model.hpp"
#include "world.hpp"

namespace jackal_aic::sim {

/// Wheels that turn exactly as their motors command, and roll on a plane without slip except for the effective track T
/// of a skid-steer robot:
///
///     v = (r_L w_L + r_R w_R)/2,    theta' = (r_R w_R - r_L w_L)/T
///
/// with the mean radius and speed of a side's wheels. It cannot be pushed or lifted, and friction has no effect.
class RollingWorld : public World {
 public:
  /// The robot at rest, base_link above the ground frame's origin. @param effective_track T [m];
  /// @param fixed_chassis it is held in the air, and only its wheels turn.
  RollingWorld(const RobotModel& model, double effective_track, bool fixed_chassis);

  void setWheelReference(std::size_t wheel, double speed) override { reference_[wheel] = speed; }
  void setFriction(double) override {}
  void push(const Eigen::Vector3d&, double) override {}
  void lift(bool) override {}
  void step(double step) override;
  ChassisState chassis() const override { return chassis_; }
  double wheelSpeed(std::size_t wheel) const override { return speed_[wheel]; }
  double wheelTorque(std::size_t) const override { return 0.0; }
  const Eigen::Vector3d& gravity() const override { return gravity_; }

 private:
  Eigen::Vector3d gravity_;
  Eigen::Vector3d centre_;  // of the chassis' mass in base_link [m]
  std::array<double, 4> radius_{};
  std::array<double, 4> reference_{};
  std::array<double, 4> speed_{};
  double effective_track_;
  bool fixed_chassis_;
  Eigen::Vector3d base_;  // base_link in the ground frame [m]
  double heading_ = 0.0;  // [rad]
  ChassisState chassis_;
};

}  // namespace jackal_aic::sim
