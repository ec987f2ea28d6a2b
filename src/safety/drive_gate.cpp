#include "jackal_aic/safety/drive_gate.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace jackal_aic {
namespace {

/// Deceleration of an emergency brake: the limit where there is one, else what is driven or braked with; 0: no bound.
double hardest(double limit, double acceleration, double brake) {
  if (limit > 0.0) return limit;
  return acceleration > 0.0 ? std::max(acceleration, brake) : 0.0;
}

DriveStatus statusAtRest(StopCause cause) {
  if (cause == StopCause::none) return DriveStatus::driving;
  if (cause == StopCause::set_point_missing) return DriveStatus::idle;
  return severity(cause) == Severity::fault ? DriveStatus::faulted : DriveStatus::stopped;
}

}  // namespace

const char* text(DriveStatus status) {
  static constexpr const char* kTexts[] = {"idle", "driving", "stopped", "braking", "faulted"};
  return kTexts[static_cast<std::size_t>(status)];
}

bool isPlausible(const BodyVector& belief, double free_energy, const GateParameters& parameters) {
  const double bound = parameters.plausibility.speed_factor;
  if (std::isinf(bound)) return true;
  const LimitParameters& limits = parameters.limits;
  const double speed = std::max(std::abs(belief(kForward)), std::abs(belief(kLateral)));
  return belief.allFinite() && std::isfinite(free_energy) && speed <= bound * limits.linear_speed &&
         std::abs(belief(kYaw)) <= bound * limits.angular_speed;
}

bool isPlausible(const SetPoint& set_point, const LimitParameters& limits) {
  return std::abs(set_point.forward) <= kAbsurdSetPoint * limits.linear_speed &&
         std::abs(set_point.lateral) <= kAbsurdSetPoint * limits.linear_speed &&
         std::abs(set_point.yaw_rate) <= kAbsurdSetPoint * limits.angular_speed;
}

DriveGate::DriveGate(const GateParameters& parameters, const GeometryParameters& geometry, double period)
    : parameters_(parameters), limiter_(parameters.limits, geometry, period), period_(period) {}

GateDecision DriveGate::decide(const GateInputs& inputs) {
  const StopCause cause = presentCause(inputs);
  const bool braking = decision_.status == DriveStatus::braking;
  if (!limiter_.atRest() && (braking || cause != StopCause::none)) {
    emergency_ = (braking && emergency_) || severity(cause) != Severity::stop;
    decision_.status = DriveStatus::braking;
    if (cause != StopCause::none) decision_.cause = cause;  // else that of the start of the brake
  } else {
    decision_.status = statusAtRest(cause);
    decision_.cause = cause;
  }
  return decision_;
}

StopCause DriveGate::presentCause(const GateInputs& inputs) {
  StopCauses causes = inputs.causes;
  causes.add(StopCause::belief_diverged, action_diverged_);
  action_diverged_ = false;
  const StopCause worst = causes.worst();
  if (latches(worst)) {
    latched_ = worst;
    gone_for_ = 0.0;
  } else {
    gone_for_ += period_;
    if (acknowledged(inputs)) latched_ = StopCause::none;
  }
  decision_.unacknowledged = latched_ > worst;
  return std::max(latched_, worst);
}

bool DriveGate::latches(StopCause cause) const {
  if (severity(cause) == Severity::fault) return true;
  const bool fault_waits = severity(latched_) == Severity::fault;  // and outlasts a stop
  return severity(cause) == Severity::halt && !fault_waits &&
         parameters_.restart_after_stop == RestartPolicy::acknowledged;
}

bool DriveGate::acknowledged(const GateInputs& inputs) const {
  const double hold = severity(latched_) == Severity::fault ? parameters_.brake.fault_hold : 0.0;
  return gone_for_ > hold && inputs.set_point_at_rest && limiter_.atRest();
}

WheelCommand DriveGate::drive(const WheelCommand& action) {
  action_diverged_ = !action.vector().allFinite();
  return limiter_.drive(action);
}

WheelCommand DriveGate::brake() {
  const BrakeParameters& brake = parameters_.brake;
  const LimitParameters& limits = parameters_.limits;
  return emergency_ ? limiter_.brake(
                          hardest(limits.linear_deceleration, limits.linear_acceleration, brake.linear_deceleration),
                          hardest(limits.angular_deceleration, limits.angular_acceleration, brake.angular_deceleration),
                          brake.time)
                    : limiter_.brake(brake.linear_deceleration, brake.angular_deceleration, brake.time);
}

void DriveGate::reset() {
  limiter_.reset();
  decision_ = {};
  emergency_ = action_diverged_ = false;
  latched_ = StopCause::start;
}

void DriveGate::release() {
  if (latched_ == StopCause::start) latched_ = StopCause::none;
}

}  // namespace jackal_aic
