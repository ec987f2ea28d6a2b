#include "jackal_aic/drive_gate.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic {
namespace {

bool fresh(double age, double deadline) { return std::abs(age) <= deadline; }

}  // namespace

GateDecision DriveGate::decide(const InputAges& ages) const {
  if (ages.set_point == kNever) return {DriveStatus::idle, "no set point received yet"};
  if (!fresh(ages.set_point, deadlines_.set_point)) return {DriveStatus::stopped, "set point too old"};
  if (ages.wheels == kNever) return {DriveStatus::stopped, "no wheel speeds received yet"};
  if (!fresh(ages.wheels, deadlines_.sensor)) return {DriveStatus::stopped, "wheel speeds too old"};
  if (ages.imu == kNever) return {DriveStatus::stopped, "no IMU data received yet"};
  if (!fresh(ages.imu, deadlines_.sensor)) return {DriveStatus::stopped, "IMU data too old"};
  if (!fresh(ages.measurement, deadlines_.sensor)) {
    return {DriveStatus::stopped, "stamps of wheel speeds and IMU data do not pair"};
  }
  return {DriveStatus::driving, ""};
}

WheelCommand DriveGate::limit(const WheelCommand& wanted) const {
  if (!wanted.vector().allFinite()) return {};
  const BodyVector body = kinematics_.bodyVelocity(wanted);
  const WheelCommand bounded =
      kinematics_.wheelSpeeds(std::clamp(body(kForward), -limits_.linear_speed, limits_.linear_speed),
                              std::clamp(body(kYaw), -limits_.angular_speed, limits_.angular_speed));
  const double fastest = std::max(std::abs(bounded.left), std::abs(bounded.right));
  const double factor = fastest > limits_.wheel_speed ? limits_.wheel_speed / fastest : 1.0;
  return {factor * bounded.left, factor * bounded.right};
}

}  // namespace jackal_aic
