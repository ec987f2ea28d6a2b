#pragma once

/// @file
/// Set points over time, and the steps in them whose response is worth measuring.

#include <cstddef>
#include <string>
#include <vector>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic::sim {

/// Rounding of times that are multiples of a step [s].
inline constexpr double kTimeTolerance = 1e-9;

/// Segments of constant set point, one after another; three lists of equal length. YAML prefix `manoeuvre`.
struct ManoeuvreParameters {
  std::vector<double> durations;  ///< of the segments [s]
  std::vector<double> forward;    ///< x_dot of the segments [m/s]
  std::vector<double> yaw_rate;   ///< theta_dot of the segments [rad/s]
};

/// Lists the fields of ManoeuvreParameters with unit and range. A response needs a second to be assessed.
template <class Visitor>
void describeFields(Visitor& v, ManoeuvreParameters& p) {
  constexpr std::size_t kMaxSegments = 1000;
  v.field("durations", p.durations, {1.0, 3600.0}, kMaxSegments, "s", Presence::required);
  v.field("forward", p.forward, {-10.0, 10.0}, kMaxSegments, "m/s", Presence::required);
  v.field("yaw_rate", p.yaw_rate, {-20.0, 20.0}, kMaxSegments, "rad/s", Presence::required);
}

/// A change of one component of the set point to a value that is not zero.
struct SetPointStep {
  std::string name;     ///< e.g. "0.5 m/s" or "0.5 rad/s"
  std::size_t change;   ///< of the timeline, with which the new value comes
  BodyChannel channel;  ///< kForward or kYaw
  double initial;       ///< value before [m/s or rad/s]
  double set_point;     ///< value after [m/s or rad/s]
};

/// Set points over time: each holds from its time on, and the robot rests before the first.
struct SetPointTimeline {
  /// A set point and the time from which it holds.
  struct Change {
    double time;         ///< [s]
    SetPoint set_point;  ///< base_link
  };
  std::vector<Change> changes;  ///< in order of time
  double duration = 0.0;        ///< end of the last [s]

  /// Changes up to and with a time [s], kTimeTolerance allowed.
  std::size_t changesUntil(double time) const;

  /// Set point at a time [s].
  SetPoint at(double time) const;

  /// The steps in it, from rest, in order, without returns to zero.
  std::vector<SetPointStep> steps() const;
};

/// The timeline of a manoeuvre, from time 0. @throws ParameterError if the lists differ in length.
SetPointTimeline timelineOf(const ManoeuvreParameters& manoeuvre);

}  // namespace jackal_aic::sim
