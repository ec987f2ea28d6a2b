#pragma once

/// @file
/// Where the robot is by what it did: the pose integrated from the body velocity.

#include <Eigen/Core>

namespace jackal_aic {

/// A pose in the plane.
struct PlanarPose {
  double x = 0.0;        ///< [m]
  double y = 0.0;        ///< [m]
  double heading = 0.0;  ///< anticlockwise from x [rad]
};

/// What a robot that cannot move sideways does (base_link).
struct PlanarMotion {
  double forward = 0.0;                                  ///< x_dot [m/s]
  double yaw_rate = 0.0;                                 ///< theta_dot [rad/s]
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< of both [(m/s)^2, (rad/s)^2]
};

/// Integrates a motion along arcs: with the heading theta, over a time h at constant x_dot and theta_dot,
///
///     theta <- theta + h theta_dot,    (x, y) <- (x, y) + h x_dot sinc(h theta_dot/2) (cos, sin)(theta + h
///     theta_dot/2).
///
/// Starts at the origin of a frame of its own, in which it drifts: with the Jacobians F of the pose by the pose before
/// and G by the motion, and an error of the motion that lasts for a time tau (Sigma its covariance),
///
///     P <- F P F' + 2 tau/h G Sigma G'.
///
/// Does not allocate.
class DeadReckoning {
 public:
  /// tau, for which an error of the motion lasts [s].
  static constexpr double kErrorTime = 0.3;

  /// Goes on by a time [s] at this motion; one that is not finite is left out.
  void advance(const PlanarMotion& motion, double duration);

  /// The pose since the start, in the frame of the start.
  const PlanarPose& pose() const { return pose_; }

  /// P, of (x, y, heading) [m^2, rad^2].
  const Eigen::Matrix3d& covariance() const { return covariance_; }

 private:
  PlanarPose pose_;
  Eigen::Matrix3d covariance_ = Eigen::Matrix3d::Zero();
};

}  // namespace jackal_aic
