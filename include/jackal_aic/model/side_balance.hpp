#pragma once

/// @file
/// Bound of what a controller makes up for on one side of the robot more than on the other.
///
/// A flat battery or a soft velocity loop slows the motors of both sides alike; tyres and motors of one robot differ
/// little. An encoder with a wrong scale looks like a slow motor of its side, and making up for it turns a robot that
/// drives straight. The gyro tells them apart: with a slow motor the robot turns as its wheels say, with a wrong
/// encoder it does not. With u commands and g those of a robot like its model,
///
///     apart = (u_R/g_R - u_L/g_L) / (u_R/g_R + u_L/g_L)
///
/// stays within the difference of one robot's sides, and does not grow while the gyro contradicts the wheels: while the
/// yaw rate is outside of
///
///     r alpha/b_hat [n - e, n + e] (track range x 4/3)^(+-1),    e = 0.03 |m| + 0.1 rad/s
///
/// with the difference n = w_R - w_L and the mean m of the wheel speeds over 0.2 s: the veer of usual tyres, and coarse
/// encoders.

#include "jackal_aic/model/geometry.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Compares gyro and wheels, and bounds the commands of both sides. Nothing here allocates.
class SideBalance {
 public:
  /// @param gyro_measures the turn of the wheels: false on a box.
  SideBalance(const GeometryParameters& geometry, bool gyro_measures);

  /// Takes a measurement and the channels that were measured.
  void observe(const Observation& y, const ChannelValidity& measured);

  /// The commands with the same mean of u/g that are within the bound [rad/s]. @param before the last commands, from
  /// which an excess may persist or decrease; @param goal g. Sides whose g is near zero are not compared.
  WheelVector bound(const WheelVector& before, const WheelVector& commands, const WheelVector& goal) const;

  /// The gyro contradicts the wheels.
  bool contradicted() const { return contradicted_; }

  /// Forgets the measurements.
  void reset();

 private:
  double slope_;  // yaw rate per difference of the wheel speeds
  double range_;  // of the slope
  bool gyro_measures_;
  double stamp_ = 0.0;                        // of the last measurement [s]
  WheelVector speeds_ = WheelVector::Zero();  // recent [rad/s]
  double yaw_rate_ = 0.0;                     // recent [rad/s]
  bool contradicted_ = false;
};

}  // namespace jackal_aic
