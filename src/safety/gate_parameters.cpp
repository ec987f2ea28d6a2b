#include "jackal_aic/safety/gate_parameters.hpp"

#include <fmt/format.h>

namespace jackal_aic {
namespace {

/// Refuses a brake that a given deceleration limit of its axis does not allow.
void checkBrake(const char* axis, double deceleration, double speed, double limit, double time) {
  if (limit == 0.0) return;
  if (deceleration > limit) {
    throw ParameterError(fmt::format("brake.{0}_deceleration = {1:g}: must be at most limits.{0}_deceleration = {2:g}",
                                     axis, deceleration, limit));
  }
  if (speed > limit * time) {
    throw ParameterError(
        fmt::format("brake.time = {1:g} s: must be at least limits.{0}_speed / limits.{0}_deceleration = {2:g} s", axis,
                    time, speed / limit));
  }
}

}  // namespace

void validate(const LimitParameters& limits, const BrakeParameters& brake) {
  checkBrake("linear", brake.linear_deceleration, limits.linear_speed, limits.linear_deceleration, brake.time);
  checkBrake("angular", brake.angular_deceleration, limits.angular_speed, limits.angular_deceleration, brake.time);
}

GateParameters readGateParameters(ParameterMap& map, GateParameters parameters) {
  parameters.limits = readParameters(map, "limits", parameters.limits);
  parameters.deadlines = readParameters(map, "deadlines", parameters.deadlines);
  parameters.brake = readParameters(map, "brake", parameters.brake);
  parameters.plausibility = readParameters(map, "plausibility", parameters.plausibility);
  ParameterReader(map, "").field("restart_after_stop", parameters.restart_after_stop, kRestartPolicyNames,
                                 Presence::optional);
  validate(parameters.limits, parameters.brake);
  return parameters;
}

}  // namespace jackal_aic
