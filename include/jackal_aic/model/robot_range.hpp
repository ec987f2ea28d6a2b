#pragma once

/// @file
/// Largest difference between a robot and its model. A controller corrects no more than that. Otherwise a sensor that
/// reads too little from its first message would make the robot several times as fast as its set point.

#include <algorithm>
#include <cmath>

namespace jackal_aic {

/// Factor by which a wheel's gain may differ from its model's, either way: a flat battery, a soft velocity loop. With
/// it and kSpeedRange a motion stays within 1.5 times its set point.
inline constexpr double kGainRange = 1.4;

/// Additional difference of speed [rad/s], 3 cm/s of a Jackal. A motor that turns slower by 0.5 rad/s
/// (clearpath_robot#280) is within both from 5 cm/s on.
inline constexpr double kSpeedRange = 0.3;

/// Usual relative difference of the tyres' radii, and so of the speeds of both sides on a straight line.
inline constexpr double kVeer = 0.03;

/// Factor on the range of the turn (robot.track_range): a turn within it counts as one at the bound.
inline constexpr double kTurnSlack = 4.0 / 3.0;

/// An interval of values.
struct Range {
  double low;   ///< least
  double high;  ///< largest

  double width() const { return high - low; }  ///< largest - least

  /// The value of the interval that is nearest.
  double nearest(double value) const { return std::clamp(value, low, high); }

  /// Signed distance of a value from the interval; 0 inside.
  double outside(double value) const { return value - nearest(value); }
};

/// Possible speeds of a wheel whose model predicts a speed in an interval; also the commands that such a speed may need
/// [rad/s].
inline Range withinRange(double low, double high) {
  return {std::min(low / kGainRange, low * kGainRange) - kSpeedRange,
          std::max(high / kGainRange, high * kGainRange) + kSpeedRange};
}

}  // namespace jackal_aic
