#pragma once

/// @file
/// The motion that excites a drive train for the identification.

#include <array>
#include <cmath>
#include <cstddef>

#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Bounds of the excitation.
struct ExcitationParameters {
  double linear_speed = 0.6;   ///< largest forward and backward speed [m/s]
  double angular_speed = 1.0;  ///< largest yaw rate [rad/s]
  double hold = 1.2;           ///< time each speed is held [s]
  double rest = 0.8;           ///< time at rest between two speeds [s]
  int repetitions = 1;         ///< of the whole sequence
};

/// Steps of half and full speed forward, backward, to the left and to the right, each from rest, so that the robot ends
/// near its start.
class Excitation {
 public:
  /// @param geometry turns yaw rates into wheel speeds.
  Excitation(const ExcitationParameters& parameters, const GeometryParameters& geometry)
      : parameters_(parameters), kinematics_(geometry) {}

  /// Wheel command at a time since the start [s]; zero after the end.
  WheelCommand at(double time) const {
    constexpr std::array<double, kSteps / 2> kParts{0.5, -0.5, 1.0, -1.0};
    const double begun = (time - parameters_.rest) / stepTime();
    if (begun < 0.0 || time > duration() || (begun - std::floor(begun)) * stepTime() >= parameters_.hold) return {};
    const int step = static_cast<int>(begun) % kSteps;
    const double part = kParts[static_cast<std::size_t>(step) % kParts.size()];
    return step < kSteps / 2 ? kinematics_.wheelSpeeds(part * parameters_.linear_speed, 0.0)
                             : kinematics_.wheelSpeeds(0.0, part * parameters_.angular_speed);
  }

  /// Length of the whole motion [s], the first and the last rest included.
  double duration() const { return parameters_.rest + parameters_.repetitions * kSteps * stepTime(); }

 private:
  static constexpr int kSteps = 8;  // half of them straight, half of them turns

  double stepTime() const { return parameters_.hold + parameters_.rest; }

  ExcitationParameters parameters_;
  SkidSteerKinematics kinematics_;
};

}  // namespace jackal_aic
