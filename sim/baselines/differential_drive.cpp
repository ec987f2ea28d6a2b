#include "differential_drive.hpp"

#include <algorithm>

namespace jackal_aic::sim {
namespace {

double limited(double wanted, double last, double speed, double change) {
  return std::clamp(std::clamp(wanted, -speed, speed), last - change, last + change);
}

}  // namespace

WheelCommand DifferentialDrive::update() {
  const auto& p = parameters_;
  forward_ = limited(set_point_.forward, forward_, p.linear_speed, p.linear_acceleration / p.rate);
  yaw_rate_ = limited(set_point_.yaw_rate, yaw_rate_, p.angular_speed, p.angular_acceleration / p.rate);
  const double half_difference = 0.5 * p.effective_track * yaw_rate_;
  const double speed_per_command = p.wheel_gain * p.wheel_radius;
  return {(forward_ - half_difference) / speed_per_command, (forward_ + half_difference) / speed_per_command};
}

void DifferentialDrive::reset() {
  set_point_ = {};
  forward_ = 0.0;
  yaw_rate_ = 0.0;
}

}  // namespace jackal_aic::sim
