#pragma once

/// @file
/// Calibration of the IMU at rest: bias of the gyro, gravity of the accelerometer.

#include <Eigen/Core>

#include "jackal_aic/model/square.hpp"
#include "jackal_aic/model/thresholds.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Calibration of the IMU at rest. The bias is the mean yaw rate at rest; it is subtracted for all users of the gyro.
/// The accelerometer is valid after it has read a specific force of 9.81 m/s^2 within kGravityTolerance, upright or
/// upside down. An absent accelerometer, one in g, or one on its side without a transform is invalid. An accelerometer
/// with an unknown vertical axis is always valid. Does not allocate.
class ImuAtRest {
 public:
  static constexpr double kGravityTime = 0.1;   ///< shortest mean for gravity [s]
  static constexpr double kLargestBias = 0.05;  ///< largest bias of the gyro; a larger yaw rate is a motion [rad/s]
  static constexpr double kGravityTolerance = 0.15;  ///< relative
  static constexpr double kLeastVertical = 0.7;      ///< part of gravity along the vertical axis

  /// Advances by a time [s]. @param command_is_zero the motors have a command of zero.
  void advance(bool command_is_zero, double duration) { rested_ = command_is_zero ? rested_ + duration : 0.0; }

  /// Takes a sample and corrects it: subtracts the bias, and invalidates a wrong accelerometer. @param step since the
  /// last sample [s].
  void calibrate(Observation& observation, double step);

  /// True for an accelerometer that has read gravity at rest, or without a known vertical axis.
  bool accelerometerCounts(const Observation& observation) const {
    return !observation.acceleration_z || readsGravity();
  }

  /// A yaw rate without the bias [rad/s]. An exact zero comes from a dead zone or a missing gyro, and stays zero.
  double withoutBias(double yaw_rate) const { return yaw_rate == 0.0 ? 0.0 : yaw_rate - gyroBias(); }

  /// Mean yaw rate at rest [rad/s] if it exceeds its noise, else 0.
  double gyroBias() const { return bias_ * bias_ > square(thresholds::kSure) * mean_variance_ ? bias_ : 0.0; }

  /// True for an accelerometer that has read another value than gravity at rest.
  bool accelerometerWrong() const { return weighed_ >= kGravityTime && !readsGravity(); }

  /// Forgets everything, for another IMU.
  void reset() { *this = ImuAtRest(); }

 private:
  void watchWheels(const Observation& observation, double step);
  void learn(const Observation& observation, double step);
  bool readsGravity() const;

  WheelVector wheels_ = WheelVector::Zero();  // mean speeds [rad/s]
  double rested_ = 0.0;                       // since the last command, or the last time a wheel turned [s]
  double bias_ = 0.0;                         // rad/s
  double biased_ = 0.0;                       // time over which the bias is a mean [s]
  double spread_ = 0.0;                       // mean square of the yaw rate about it [(rad/s)^2]
  double mean_variance_ = 0.0;                // of the bias [(rad/s)^2]
  Eigen::Vector3d force_ = Eigen::Vector3d::Zero();
  double weighed_ = 0.0;  // time over which the specific force is a mean [s]
};

}  // namespace jackal_aic
