#pragma once

/// @file
/// A set point followed over time, and the steps in it whose response is worth measuring.

#include <cstddef>
#include <string>
#include <vector>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/model/types.hpp"

namespace jackal_aic::sim {

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
  std::size_t segment;  ///< in which the new value holds
  BodyChannel channel;  ///< kForward or kYaw
  double initial;       ///< value before [m/s or rad/s]
  double set_point;     ///< value after [m/s or rad/s]
};

/// Set point over time.
class Manoeuvre {
 public:
  /// @throws ParameterError if the lists differ in length.
  explicit Manoeuvre(const ManoeuvreParameters& parameters);

  /// Number of segments.
  std::size_t size() const { return parameters_.durations.size(); }

  /// Time at which a segment begins [s]; for size(), the end of the manoeuvre.
  double startOf(std::size_t segment) const { return starts_[segment]; }

  /// Duration of the whole manoeuvre [s].
  double duration() const { return starts_.back(); }

  /// Segment at a time since the start of the manoeuvre [s]; the first before it, the last after its end.
  std::size_t segmentAt(double time) const;

  /// Set point of a segment.
  SetPoint setPoint(std::size_t segment) const;

  /// The steps of the manoeuvre, from rest, in order. A return to zero is none.
  std::vector<SetPointStep> steps() const;

 private:
  ManoeuvreParameters parameters_;
  std::vector<double> starts_;  // size() + 1 of them, s
};

}  // namespace jackal_aic::sim
