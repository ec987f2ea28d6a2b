#pragma once

/// @file
/// Extended differential drive kinematics of a skid-steer robot (eq. 3-1, 3-2) and the matrices that follow from it.

#include <Eigen/Core>

#include "jackal_aic/model/geometry.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Kinematics of a skid-steer robot seen as a differential drive with a virtual width b_hat and a slip factor alpha.
class SkidSteerKinematics {
 public:
  /// @param geometry wheel radius, effective track and slip.
  explicit SkidSteerKinematics(const GeometryParameters& geometry) : geometry_(geometry) {}

  /// Body velocity (base_link) of given wheel speeds: mu = G (omega_L, omega_R) (3-1).
  BodyVector bodyVelocity(const WheelCommand& wheels) const;

  /// Wheel speeds of a forward speed [m/s] and yaw rate [rad/s]: the inverse of (3-1) for x_dot and theta_dot.
  WheelCommand wheelSpeeds(double forward, double yaw_rate) const;

  /// Yaw rate per difference w_R - w_L of the wheel speeds, r alpha / b_hat (3-1).
  double yawPerDifference() const { return geometry_.wheel_radius * geometry_.slip_factor / geometry_.effective_track; }

  /// G, 3x2: wheel speeds to body velocity (3-2).
  Eigen::Matrix<double, kBodySize, 2> forwardMatrix() const;

  /// R, 5x3: body velocity to measured channels (3-3, 3-4). Its accelerometer rows are zero.
  Eigen::Matrix<double, kSensorSize, kBodySize> sensoryMap() const;

  /// K, 2x5: the forward model d(eps_y)/d(a) (3-14).
  Eigen::Matrix<double, 2, kSensorSize> forwardModel() const;

  const GeometryParameters& geometry() const { return geometry_; }  ///< as given

 private:
  GeometryParameters geometry_;
};

}  // namespace jackal_aic
