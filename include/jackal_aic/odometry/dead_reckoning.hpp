#pragma once

/// @file
/// The pose as the integral of the body velocity.

#include <Eigen/Core>

namespace jackal_aic {

/// A pose in the plane.
struct PlanarPose {
  double x = 0.0;        ///< [m]
  double y = 0.0;        ///< [m]
  double heading = 0.0;  ///< anticlockwise from x [rad]
};

/// Motion of a robot without sideways motion (base_link).
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
/// The pose starts at the origin and drifts. With the Jacobians F by the last pose and G by the motion, and an error of
/// the motion (covariance Sigma) that lasts for a time tau, its covariance is
///
///     P <- F P F' + 2 tau/h G Sigma G'.
///
/// Does not allocate.
class DeadReckoning {
 public:
  /// tau, for which an error of the motion lasts [s].
  static constexpr double kErrorTime = 0.3;

  /// Advances by a time [s] at this motion; ignores a motion that is not finite.
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
