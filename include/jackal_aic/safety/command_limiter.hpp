#pragma once

/// @file
/// Bounds on the drive command from one action step to the next: body velocity and acceleration, wheel speed.

#include <Eigen/Core>

#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/safety/gate_parameters.hpp"

namespace jackal_aic {

/// Regulates the wheel command. Speeds, and changes since the last command, are bounded by one factor on both wheels,
/// which keeps the curvature of the path. Deceleration is a change of an axis towards zero, in both directions of
/// driving. Nothing allocates or throws.
class CommandLimiter {
 public:
  /// @param period time from one command to the next [s].
  CommandLimiter(const LimitParameters& limits, const GeometryParameters& geometry, double period);

  /// The next command, as near to the wanted one as the bounds allow. A wanted command that is not finite brakes at the
  /// deceleration limits.
  WheelCommand drive(const WheelCommand& wanted);

  /// The next command of a brake to zero in equal steps on the present curvature, which takes max(|x_dot|/linear,
  /// |theta_dot|/angular), but `longest` at most, from its first call on.
  /// @param linear, angular decelerations [m/s^2], [rad/s^2], 0 for unbounded; @param longest [s].
  WheelCommand brake(double linear, double angular, double longest);

  /// A set point scaled into the speed limits, with its curvature and without lateral speed.
  SetPoint reachable(const SetPoint& wanted) const;

  /// The last command.
  WheelCommand command() const { return kinematics_.wheelSpeeds(body_(0), body_(1)); }

  /// True if the last command was zero.
  bool atRest() const { return body_.isZero(0.0); }

  /// Sets the last command to zero.
  void reset();

  /// Sets the last command to that of another source; the next one continues from it.
  void follow(const WheelCommand& applied);

 private:
  using Vector = Eigen::Vector2d;  // forward, yaw: m/s, rad/s

  Vector bodyVelocity(const WheelCommand& wheels) const;
  double speedFactor(const Vector& body) const;
  double largestChange(int axis, double error) const;

  LimitParameters limits_;
  SkidSteerKinematics kinematics_;
  double period_;
  Vector largest_rise_;  // of the speed per step, by acceleration; infinite without a bound
  Vector largest_fall_;  // of the speed per step, by deceleration; infinite without a bound
  Vector body_ = Vector::Zero();
  int brake_steps_left_ = 0;  // 0 while not braking
};

}  // namespace jackal_aic
