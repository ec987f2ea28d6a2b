#pragma once

/// @file
/// Standstill: a robot at rest whose set point is zero gets a command of zero.
///
/// A belief of noisy measurements never rests, and an action that follows it never does. A robot stands if its command
/// and its speed were both below kNothing, on average over kMemory; it no longer stands at twice that speed.
///
/// A command that is left at rest holds the robot against a slope, or lies in the dead zone of its motors. Once for
/// each stop the command is released slowly, until it is zero or the robot moves.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Decides how large the command of a robot that rests may be. Allocates nothing.
class Standstill {
 public:
  static constexpr double kNothing = 0.02;  ///< wheel speed or command that counts as nothing [rad/s]
  static constexpr double kMemory = 0.5;    ///< over which both are averaged [s]
  static constexpr double kPatience = 1.0;  ///< at rest, before a command is released [s]
  static constexpr double kRelease = 0.3;   ///< rate at which it is [rad/s^2]
  static constexpr double kFree = std::numeric_limits<double>::infinity();  ///< a limit that is none [rad/s]

  /// One action period [s] on. @param told_to_stand the set point is zero; @param command that would be sent [rad/s];
  /// @param left, right believed wheel speeds [rad/s].
  /// @return largest command to send, either way [rad/s]: kFree, less and less of one that is released, or zero of a
  /// robot that stands.
  double largestCommand(bool told_to_stand, const WheelCommand& command, double left, double right, double period) {
    const double part = -std::expm1(-period / kMemory);
    command_ += part * (bounded({command.left, command.right}) - command_);
    speed_ += part * (bounded({left, right}) - speed_);
    const bool held_back = limit_ < kFree;
    const bool rests = speed_.cwiseAbs().maxCoeff() < (held_back ? 2.0 : 1.0) * kNothing;
    if (!told_to_stand || !rests) {
      needed_ = told_to_stand && (needed_ || held_back);
      rested_ = 0.0;
      return limit_ = kFree;
    }
    rested_ += period;
    if (held_back) return limit_ = std::max(0.0, limit_ - kRelease * period);
    if (command_.cwiseAbs().maxCoeff() < kNothing) return limit_ = 0.0;
    if (rested_ > kPatience && !needed_) limit_ = command.vector().cwiseAbs().maxCoeff();
    return limit_;
  }

 private:
  /// However fast it was, five times nothing is enough to tell, and soon forgotten.
  static WheelVector bounded(const WheelVector& x) { return x.cwiseMin(5.0 * kNothing).cwiseMax(-5.0 * kNothing); }

  WheelVector command_ = WheelVector::Zero();
  WheelVector speed_ = WheelVector::Zero();
  double limit_ = kFree;  // [rad/s]
  double rested_ = 0.0;   // [s]
  bool needed_ = false;   // without the command the robot was found moving, since it was told to stand
};

}  // namespace jackal_aic
