#pragma once

/// @file
/// How far a robot may be from its model. A controller makes up for no more than that: a sensor that reads too little
/// from its first message would otherwise make the robot several times as fast as its set point.

#include <algorithm>
#include <cmath>

namespace jackal_aic {

/// Factor by which a wheel's gain may differ from its model's, either way: a flat battery, a soft velocity loop. With
/// it and kSpeedRange a motion stays within 1.5 times its set point.
inline constexpr double kGainRange = 1.5;

/// Speed by which it may differ beside [rad/s], 3.5 cm/s of a Jackal. A motor that turns slower by 0.5 rad/s
/// (clearpath_robot#280) is within both from 3 cm/s on.
inline constexpr double kSpeedRange = 0.35;

/// An interval of values.
struct Range {
  double low;   ///< least
  double high;  ///< largest

  /// The value of the interval that is nearest.
  double nearest(double value) const { return std::clamp(value, low, high); }

  /// How far a value is outside, with its sign; 0 inside.
  double outside(double value) const { return value - nearest(value); }
};

/// Speeds of a wheel that its model says has a speed of an interval; likewise, what the model has to be asked for
/// [rad/s].
inline Range withinRange(double low, double high) {
  return {std::min(low / kGainRange, low * kGainRange) - kSpeedRange,
          std::max(high / kGainRange, high * kGainRange) + kSpeedRange};
}

}  // namespace jackal_aic
