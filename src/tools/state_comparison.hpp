#pragma once

/// @file
/// Compares what a controller computes with what it computed when it was recorded.

#include <jackal_aic/ControllerState.h>

#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "jackal_aic/safety/drive_loop.hpp"

namespace jackal_aic {

/// What a drive loop does after one action update.
struct ReplayedState {
  double time = 0.0;  ///< of the update [s]
  DriveLoopStatus status;
  SetPoint set_point;  ///< in force
  BodyVector measured = BodyVector::Constant(
      std::numeric_limits<double>::quiet_NaN());  ///< x_dot by the wheels, theta_dot by the gyro; NaN before the first
  BodyVector belief = BodyVector::Zero();         ///< order 0
  double free_energy = 0.0;
  WheelCommand action;   ///< before the limits [rad/s]
  WheelCommand command;  ///< [rad/s]
};

/// Goes through recorded and replayed states together.
class StateComparison {
 public:
  /// @param recorded in the order of recording; @param tolerance largest distance of two states that are compared [s].
  StateComparison(std::vector<ControllerState> recorded, double tolerance)
      : recorded_(std::move(recorded)), tolerance_(tolerance) {}

  /// The recorded state of the time of a replayed one, which is compared with it; nullptr if there is none.
  const ControllerState* compare(const ReplayedState& replayed);

  std::size_t compared() const { return compared_; }    ///< states
  std::size_t different() const { return different_; }  ///< of them, in status, set point, belief, action or command

  /// What there is to tell: one line or two.
  std::string text() const;

 private:
  const ControllerState* find(double time);

  std::vector<ControllerState> recorded_;
  double tolerance_;
  std::size_t next_ = 0;
  std::size_t compared_ = 0;
  std::size_t different_ = 0;
  std::size_t different_status_ = 0;
  double first_difference_ = 0.0;  // time of it [s]
  double largest_command_ = 0.0;   // difference [rad/s]
  double command_squares_ = 0.0;   // [(rad/s)^2]
  double largest_forward_ = 0.0;   // of the belief [m/s]
  double largest_yaw_rate_ = 0.0;  // of the belief [rad/s]
};

}  // namespace jackal_aic
