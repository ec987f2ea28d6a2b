#pragma once

/// @file
/// Whether a robot that is told to stand can be left alone with a command of zero.
///
/// A belief of noisy measurements never rests, and an action that follows it never does. At rest that is all there is
/// to follow, unless something pushes the robot that the action has to hold against, such as a slope under motors
/// whose velocity loop gives way. So a robot stands if what it was commanded and what it does were both nothing, on
/// average over kMemory. It no longer does when it is found moving at twice that speed; the action it then gets to hold
/// it is one that does not count as nothing, so that it does not begin anew.

#include <Eigen/Core>
#include <cmath>

#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Decides about a command of zero. Allocates nothing.
class Standstill {
 public:
  static constexpr double kNothing = 0.02;  ///< wheel speed or command that counts as nothing [rad/s]
  static constexpr double kMemory = 0.5;    ///< over which both are averaged [s]

  /// One action period [s] on. @param told_to_stand the set point is zero; @param command that would be sent [rad/s];
  /// @param left, right believed wheel speeds [rad/s]. True if the robot stands: zero is what to send.
  bool stands(bool told_to_stand, const WheelCommand& command, double left, double right, double period) {
    const double part = -std::expm1(-period / kMemory);
    command_ += part * (bounded({command.left, command.right}) - command_);
    speed_ += part * (bounded({left, right}) - speed_);
    const double speed = speed_.cwiseAbs().maxCoeff();
    stands_ = told_to_stand && speed < (stands_ ? 2.0 : 1.0) * kNothing &&
              (stands_ || command_.cwiseAbs().maxCoeff() < kNothing);
    return stands_;
  }

 private:
  /// However fast it was, five times nothing is enough to tell, and soon forgotten.
  static WheelVector bounded(const WheelVector& x) { return x.cwiseMin(5.0 * kNothing).cwiseMax(-5.0 * kNothing); }

  WheelVector command_ = WheelVector::Zero();
  WheelVector speed_ = WheelVector::Zero();
  bool stands_ = false;
};

}  // namespace jackal_aic
