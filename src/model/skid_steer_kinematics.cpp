#include "jackal_aic/model/skid_steer_kinematics.hpp"

namespace jackal_aic {

BodyVector SkidSteerKinematics::bodyVelocity(const WheelCommand& wheels) const {
  return forwardMatrix() * wheels.vector();
}

WheelCommand SkidSteerKinematics::wheelSpeeds(double forward, double yaw_rate) const {
  const double half_difference = 0.5 * geometry_.effective_track * yaw_rate;
  const double rolling_radius = geometry_.wheel_radius * geometry_.slip_factor;
  return {(forward - half_difference) / rolling_radius, (forward + half_difference) / rolling_radius};
}

Eigen::Matrix<double, kBodySize, 2> SkidSteerKinematics::forwardMatrix() const {
  const double r_alpha = geometry_.wheel_radius * geometry_.slip_factor;
  const double b = geometry_.effective_track;
  Eigen::Matrix<double, kBodySize, 2> G;
  G << 0.5, 0.5,  //
      0.0, 0.0,   //
      -1.0 / b, 1.0 / b;
  return r_alpha * G;
}

Eigen::Matrix<double, kSensorSize, kBodySize> SkidSteerKinematics::sensoryMap() const {
  const double r_alpha = geometry_.wheel_radius * geometry_.slip_factor;
  const double b = geometry_.effective_track;
  Eigen::Matrix<double, kSensorSize, kBodySize> R;
  R << 0.0, 0.0, 1.0,                            //
      1.0 / r_alpha, 0.0, -b / (2.0 * r_alpha),  //
      1.0 / r_alpha, 0.0, b / (2.0 * r_alpha),   //
      0.0, 0.0, 0.0,                             //
      0.0, 0.0, 0.0;
  return R;
}

Eigen::Matrix<double, 2, kSensorSize> SkidSteerKinematics::forwardModel() const {
  const double ratio = yawPerDifference();
  Eigen::Matrix<double, 2, kSensorSize> K;
  K << -ratio, 1.0, 0.0, 0.0, 0.0,  //
      ratio, 0.0, 1.0, 0.0, 0.0;
  return K;
}

}  // namespace jackal_aic
