#include "manoeuvre.hpp"

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

Manoeuvre::Manoeuvre(const ManoeuvreParameters& parameters) : parameters_(parameters), starts_{0.0} {
  requireLength("manoeuvre.forward", parameters_.forward, size());
  requireLength("manoeuvre.yaw_rate", parameters_.yaw_rate, size());
  for (double duration : parameters_.durations) starts_.push_back(starts_.back() + duration);
}

std::size_t Manoeuvre::segmentAt(double time) const {
  const auto next = std::upper_bound(starts_.begin() + 1, starts_.end() - 1, time);
  return static_cast<std::size_t>(next - starts_.begin()) - 1;
}

SetPoint Manoeuvre::setPoint(std::size_t segment) const {
  return {parameters_.forward[segment], 0.0, parameters_.yaw_rate[segment]};
}

std::vector<SetPointStep> Manoeuvre::steps() const {
  std::vector<SetPointStep> steps;
  SetPoint before;
  for (std::size_t i = 0; i < size(); ++i) {
    const SetPoint after = setPoint(i);
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
