#pragma once

/// @file
/// One axis of the accelerometer:
///
///     a = predicted + g + l omega^2 + noise
///
/// g stands for inclination and offset, and wanders; l is how far the IMU lies off the centre of the turn.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "jackal_aic/faults/density.hpp"
#include "jackal_aic/faults/jitter.hpp"
#include "jackal_aic/faults/offset.hpp"
#include "jackal_aic/faults/repetition.hpp"

namespace jackal_aic::faults {

/// ln of the densities of a sample under what may be wrong with it.
struct AxisEvidence {
  double healthy = 0.0, jolted = 0.0, offset = 0.0, offset_begins = 0.0, frozen = 0.0;
};

/// Prediction of one axis and what its samples say. Does not allocate.
class AccelerationAxis {
 public:
  /// @param least variance of the noise [(m/s^2)^2]; @param steepest |g| of ground that a robot stands on [m/s^2];
  /// @param lever standard deviation of l [m].
  AccelerationAxis(double least, double steepest, double lever);

  /// What it measures beside the predicted acceleration, g + l omega^2 [m/s^2]. @param yaw_rate omega [rad/s].
  double beside(double yaw_rate) const { return theta_(0) + theta_(1) * square(yaw_rate); }

  /// Takes a sample. @param error between it, the prediction and beside() [m/s^2]; @param doubt variance of the
  /// prediction; @param speed v of the robot, with which vibration grows [m/s]; @param yaw_rate omega [rad/s]; @param
  /// step since the last sample [s].
  AxisEvidence weigh(double measured, double error, double doubt, double speed, double yaw_rate, Repetition::Kind kind,
                     double step);

  /// Learns from the sample that was weighed. @param explained change that the motion explains [m/s^2]; @param healthy
  /// probability that it is healthy; @param fresh weight of an offset that has just begun.
  /// @param range width of the range in which the prediction may be anywhere: it tells the less of g [m/s^2]; @param
  /// excluded only g is learned, as far as it is no fault: it may have changed when the sensor counts again.
  void learn(double explained, double range, double healthy, double fresh, bool excluded, double step);

  /// ln p of the sample if its error is another one [m/s^2].
  double logDensity(double error) const { return logStudent(square(error), variance_); }

  bool repeats(double measured) const { return repetition_.repeats(measured); }  ///< as the last sample
  double error() const { return error_; }                                        ///< of the last sample [m/s^2]

  /// g may be any: the robot stands on other ground.
  void widen() { P_.row(0) = P_.col(0).transpose() = Eigen::RowVector2d(square(kUnknown), 0.0); }

 private:
  static constexpr double kUnknown = 1.0;          // standard deviation of g at the start, 6 degrees [m/s^2]
  static constexpr double kWandering = 0.3;        // of g after a second [m/s^2]
  static constexpr double kVibrationMemory = 5.0;  // over which it is learned how much the speed shakes [s]
  static constexpr double kJolt = 8.0;             // noise of a jolt in multiples of the usual one
  static constexpr double kLeastOffset = 2.0;      // of a fault; a smaller one is an inclination (12 degrees) [m/s^2]

  Eigen::Vector2d theta_{0.0, 0.0};  // g, l
  Eigen::Vector2d row_{1.0, 0.0};    // of the last sample
  Eigen::Matrix2d P_;
  Jitter noise_;
  double steepest_;
  double vibration_ = 0.0;  // variance by that of the speed: vibration is no white noise [1/s^2]
  Offset offset_{square(kOffset), kLeastOffset};
  Repetition repetition_;
  Repetition::Kind kind_ = Repetition::rest;
  double measured_ = 0.0, error_ = 0.0, variance_ = 1.0, speed_squared_ = 1.0;

 public:
  static constexpr double kOffset = 5.0;  ///< standard deviation of the offset of a faulty axis [m/s^2]
};

}  // namespace jackal_aic::faults
