#pragma once

/// @file
/// Dimensions of the robot.

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic {

/// Geometry of the robot in the generative model (eq. 3-1). YAML prefix `robot`.
struct GeometryParameters {
  static constexpr double kTrackRange = 1.5;  ///< default of track_range

  double wheel_radius = 0.098;       ///< r [m]
  double effective_track = 0.5621;   ///< b_hat, virtual width of the skid-steer robot [m]
  double slip_factor = 1.0;          ///< alpha, ratio of body to wheel circumference speed
  double track_range = kTrackRange;  ///< largest ratio of learned and configured effective track
};

/// Lists the fields of GeometryParameters with unit and range.
template <class Visitor>
void describeFields(Visitor& v, GeometryParameters& p) {
  v.field("wheel_radius", p.wheel_radius, {0.01, 1.0}, "m", Presence::optional);
  v.field("effective_track", p.effective_track, {0.05, 5.0}, "m", Presence::optional);
  v.field("slip_factor", p.slip_factor, {0.1, 2.0}, "", Presence::optional);
  v.field("track_range", p.track_range, {1.0, 4.0}, "", Presence::optional);
}

}  // namespace jackal_aic
