#pragma once

/// @file
/// What an EKF of the robot makes of an odometry: robot_localization as the stock Jackal configures it, in the plane.

#include <Eigen/Core>

#include "jackal_aic/odometry/dead_reckoning.hpp"

namespace jackal_aic::sim {

/// The filter of ekf_localization_node for a robot that stays in the plane and cannot move sideways. Of its state the
/// velocities are measured and the pose is not, so that the pose follows from
///
///     s = (x_dot, x_ddot, theta_dot),   x_dot <- x_dot + h x_ddot,   P <- F P F' + h Q,
///     (x, y) <- (x, y) + (h x_dot + h^2/2 x_ddot) (cos theta, sin theta),   theta <- theta + h theta_dot
///
/// with Q of the stock configuration (process_noise_covariance: 1, 1 and 90 degrees). The yaw of the IMU is left out:
/// it is that of a compass, which the simulated robot would have without error.
class PlanarEkf {
 public:
  /// Goes on by a time h [s].
  void predict(double duration);

  /// Takes the twist of an odometry.
  void correct(const PlanarMotion& motion);

  /// Takes theta_dot of a gyro [rad/s]. @param variance [(rad/s)^2].
  void correct(double yaw_rate, double variance);

  /// The pose since the start, in the frame of the start.
  const PlanarPose& pose() const { return pose_; }

 private:
  PlanarPose pose_;
  Eigen::Vector3d state_ = Eigen::Vector3d::Zero();                  // s
  Eigen::Matrix3d covariance_ = 1e-9 * Eigen::Matrix3d::Identity();  // P, at first as in robot_localization
};

}  // namespace jackal_aic::sim
