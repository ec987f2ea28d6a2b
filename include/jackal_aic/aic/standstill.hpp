#pragma once

/// @file
/// Standstill: a robot at rest whose set point is zero gets a command of zero.
///
/// A robot stands if its command and its speed were both below kRestThreshold, on average over kAveragingTime; it no
/// longer stands at twice that speed. A command that remains at rest holds the robot on a slope, or lies in the dead
/// zone of its motors. Once for each stop it is released slowly, until it is zero or the robot moves.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Largest command of a robot at rest. Allocates nothing.
class Standstill {
 public:
  static constexpr double kRestThreshold = 0.02;  ///< wheel speed or command at rest [rad/s]
  static constexpr double kAveragingTime = 0.5;   ///< over which both are averaged [s]
  static constexpr double kReleaseRate = 0.3;     ///< rate of the release [rad/s^2]

  /// Advances by an action period [s]. @param set_point_is_zero true without a wanted motion; @param command that would
  /// be sent [rad/s]; @param wheels believed speeds [rad/s].
  /// @return largest command to send, either way [rad/s]: infinite, a falling limit during the release, or zero at
  /// rest.
  double largestCommand(bool set_point_is_zero, const WheelVector& command, const WheelVector& wheels, double period) {
    const double part = -std::expm1(-period / kAveragingTime);
    command_ += part * (bounded(command) - command_);
    speed_ += part * (bounded(wheels) - speed_);
    const bool held_back = limit_ < HUGE_VAL;
    const bool rests = speed_.cwiseAbs().maxCoeff() < (held_back ? 2.0 : 1.0) * kRestThreshold;
    if (!set_point_is_zero || !rests) {
      needed_ = set_point_is_zero && (needed_ || held_back);
      rested_ = 0.0;
      return limit_ = HUGE_VAL;
    }
    rested_ += period;
    if (held_back) return limit_ = std::max(0.0, limit_ - kReleaseRate * period);
    if (command_.cwiseAbs().maxCoeff() < kRestThreshold) return limit_ = 0.0;
    if (rested_ > 2.0 * kAveragingTime && !needed_) limit_ = command.cwiseAbs().maxCoeff();
    return limit_;
  }

 private:
  /// Bounds both at five times the threshold, so that the average falls soon after a fast motion.
  static WheelVector bounded(const WheelVector& x) {
    return x.cwiseMin(5.0 * kRestThreshold).cwiseMax(-5.0 * kRestThreshold);
  }

  WheelVector command_ = WheelVector::Zero();
  WheelVector speed_ = WheelVector::Zero();
  double limit_ = HUGE_VAL;  // [rad/s]
  double rested_ = 0.0;      // [s]
  bool needed_ = false;      // the robot moved without the command, since its set point is zero
};

}  // namespace jackal_aic
