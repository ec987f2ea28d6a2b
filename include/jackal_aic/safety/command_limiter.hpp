#pragma once

/// @file
/// Bounds on the drive command from one action step to the next: body velocity, acceleration and jerk, wheel speed.

#include <Eigen/Core>
#include <optional>

#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/safety/gate_parameters.hpp"

namespace jackal_aic {

/// Regulates the wheel command. Speeds, and changes since the last command, are bounded by one factor on both wheels,
/// which keeps the curvature of the path; with a jerk limit the axes change separately if one factor would break it.
/// Speed and acceleration bounds hold always, the jerk bound within them. Deceleration is a change of an axis towards
/// zero, in both directions of driving. A jerk limit needs the end of a change, which is the set point. Nothing
/// allocates or throws.
class CommandLimiter {
 public:
  /// @param period time from one command to the next [s].
  CommandLimiter(const LimitParameters& limits, const GeometryParameters& geometry, double period);

  /// The next command, as near to the wanted one as the bounds allow. A wanted command that is not finite brakes at the
  /// deceleration limits. @param set_point the end of the wanted commands, if they still change.
  WheelCommand drive(const WheelCommand& wanted, const std::optional<SetPoint>& set_point = {});

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
  Vector change(const Vector& error, const Vector& way) const;
  double separateChange(int axis, double error, double way) const;
  double largestChange(int axis, double error) const;
  bool keepsJerk(const Vector& change) const;
  double allowedFraction(const Vector& step) const;  // by the wheels' limit, where separate axes cut its corners

  LimitParameters limits_;
  SkidSteerKinematics kinematics_;
  double period_;
  Vector largest_rise_;        // of the speed per step, by acceleration; infinite without a bound
  Vector largest_fall_;        // of the speed per step, by deceleration; infinite without a bound
  Vector largest_difference_;  // between the changes of two steps, by jerk; infinite without a bound
  Vector body_ = Vector::Zero();
  Vector last_change_ = Vector::Zero();
  int brake_steps_left_ = 0;  // 0 while not braking
};

}  // namespace jackal_aic
