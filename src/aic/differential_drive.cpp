#include "jackal_aic/aic/differential_drive.hpp"

#include <algorithm>

#include "jackal_aic/model/skid_steer_kinematics.hpp"

namespace jackal_aic {
namespace {

double limited(double wanted, double last, double speed, double change) {
  return std::clamp(std::clamp(wanted, -speed, speed), last - change, last + change);
}

}  // namespace

GeometryParameters DifferentialDriveParameters::geometry() const {
  GeometryParameters geometry;
  geometry.wheel_radius = wheel_radius;
  geometry.effective_track = effective_track;
  return geometry;
}

bool DifferentialDrive::setSetPoint(const SetPoint& set_point) {
  if (!set_point.vector().allFinite()) return false;
  set_point_ = set_point;
  return true;
}

SampleVerdict DifferentialDrive::observe(const Observation& observation) {
  if (!observation.finite()) return SampleVerdict::not_finite;
  if (observed_ && observation.stamp <= stamp_) return SampleVerdict::stale;
  const bool first = !observed_;
  observed_ = true;
  stamp_ = observation.stamp;
  return first ? SampleVerdict::restarted : SampleVerdict::accepted;
}

WheelCommand DifferentialDrive::updateAction() {
  const auto& p = parameters_;
  forward_ = limited(set_point_.forward, forward_, p.linear_speed, p.linear_acceleration / p.rate);
  yaw_rate_ = limited(set_point_.yaw_rate, yaw_rate_, p.angular_speed, p.angular_acceleration / p.rate);
  const double half_difference = 0.5 * p.effective_track * yaw_rate_;
  const double speed_per_command = p.wheel_gain * p.wheel_radius;
  action_ = {(forward_ - half_difference) / speed_per_command, (forward_ + half_difference) / speed_per_command};
  return action_;
}

void DifferentialDrive::hold(const WheelCommand& applied) {
  if (applied != action_) overrule(applied);
}

void DifferentialDrive::overrule(const WheelCommand& applied) {
  const double speed_per_command = parameters_.wheel_gain * parameters_.wheel_radius;
  forward_ = 0.5 * speed_per_command * (applied.right + applied.left);
  yaw_rate_ = speed_per_command * (applied.right - applied.left) / parameters_.effective_track;
  action_ = applied;
}

void DifferentialDrive::reset() {
  set_point_ = {};
  observed_ = false;
  restart();
}

}  // namespace jackal_aic
