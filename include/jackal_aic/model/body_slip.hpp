#pragma once

/// @file
/// Slip of the tyres that pull the body along. A body that follows its wheels with a lag T has on each side the slip
///
///     T ds/dt = T dv/dt - s,
///
/// which outlasts the acceleration of the wheels.

namespace jackal_aic {

/// Slip of both sides. Does not allocate.
class BodySlip {
 public:
  /// @param lag T [s].
  explicit BodySlip(double lag) : lag_(lag) {}

  /// Advances by a time [s] with the accelerations of the sides, dv/dt [m/s^2].
  void predict(double left, double right, double duration) {
    // T ds/dt = T dv/dt - s, by the implicit Euler step
    left_ = lag_ * (left_ + duration * left) / (lag_ + duration);
    right_ = lag_ * (right_ + duration * right) / (lag_ + duration);
  }

  /// Square of the error of the forward speed, 1/2 (s_L^2 + s_R^2) [(m/s)^2].
  double variance() const { return 0.5 * (left_ * left_ + right_ * right_); }

  double difference() const { return right_ - left_; }  ///< s_R - s_L [m/s]

  /// Sets the slip to zero.
  void reset() { left_ = right_ = 0.0; }

 private:
  double lag_;
  double left_ = 0.0, right_ = 0.0;  // s_L, s_R [m/s]
};

}  // namespace jackal_aic
