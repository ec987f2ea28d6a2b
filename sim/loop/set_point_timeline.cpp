#include "set_point_timeline.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace jackal_aic::sim {
namespace {

void requireLength(const char* key, const std::vector<double>& list, std::size_t length) {
  if (list.size() != length) {
    throw ParameterError(fmt::format("{}: has {} values; manoeuvre.durations has {}", key, list.size(), length));
  }
}

}  // namespace

SetPointTimeline timelineOf(const ManoeuvreParameters& manoeuvre) {
  const std::size_t segments = manoeuvre.durations.size();
  requireLength("manoeuvre.forward", manoeuvre.forward, segments);
  requireLength("manoeuvre.yaw_rate", manoeuvre.yaw_rate, segments);
  SetPointTimeline timeline;
  for (std::size_t i = 0; i < segments; ++i) {
    timeline.changes.push_back({timeline.duration, {manoeuvre.forward[i], 0.0, manoeuvre.yaw_rate[i]}});
    timeline.duration += manoeuvre.durations[i];
  }
  return timeline;
}

std::size_t SetPointTimeline::changesUntil(double time) const {
  const auto later = std::upper_bound(changes.begin(), changes.end(), time + kTimeTolerance,
                                      [](double end, const Change& change) { return end < change.time; });
  return static_cast<std::size_t>(later - changes.begin());
}

SetPoint SetPointTimeline::at(double time) const {
  const std::size_t begun = changesUntil(time);
  return begun == 0 ? SetPoint{} : changes[begun - 1].set_point;
}

std::vector<SetPointStep> SetPointTimeline::steps() const {
  std::vector<SetPointStep> steps;
  SetPoint before;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const SetPoint& after = changes[i].set_point;
    if (after.forward != before.forward && after.forward != 0.0) {
      steps.push_back({fmt::format("{:g} m/s", after.forward), i, kForward, before.forward, after.forward});
    }
    if (after.yaw_rate != before.yaw_rate && after.yaw_rate != 0.0) {
      steps.push_back({fmt::format("{:g} rad/s", after.yaw_rate), i, kYaw, before.yaw_rate, after.yaw_rate});
    }
    before = after;
  }
  return steps;
}

}  // namespace jackal_aic::sim
