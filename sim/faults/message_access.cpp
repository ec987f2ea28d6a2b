#include "message_access.hpp"

#include <string>

namespace jackal_aic::sim {
namespace {

bool isOn(const std::string& joint, const char* side) { return joint.find(side) != std::string::npos; }

bool touches(FaultChannel channel, FaultChannel part) { return channel == FaultChannel::all || channel == part; }

void apply(double& value, const ValueMap& map) { value = map(value); }
void apply(float& value, const ValueMap& map) { value = static_cast<float>(map(static_cast<double>(value))); }

/// Rotation by half a turn about x.
void turnOver(geometry_msgs::Vector3& vector) {
  vector.y = -vector.y;
  vector.z = -vector.z;
}

}  // namespace

void mapValues(sensor_msgs::JointState& message, FaultChannel channel, const ValueMap& map) {
  for (std::size_t i = 0; i < message.name.size() && i < message.velocity.size(); ++i) {
    const bool left = isOn(message.name[i], "left") && touches(channel, FaultChannel::left);
    const bool right = isOn(message.name[i], "right") && touches(channel, FaultChannel::right);
    if (left || right) apply(message.velocity[i], map);
  }
}

void mapValues(sensor_msgs::Imu& message, FaultChannel channel, const ValueMap& map) {
  if (touches(channel, FaultChannel::gyro)) apply(message.angular_velocity.z, map);
  if (!touches(channel, FaultChannel::acceleration)) return;
  apply(message.linear_acceleration.x, map);
  apply(message.linear_acceleration.y, map);
  apply(message.linear_acceleration.z, map);
}

void mapValues(jackal_msgs::Feedback& message, FaultChannel channel, const ValueMap& map) {
  if (touches(channel, FaultChannel::left)) apply(message.drivers[jackal_msgs::Drive::LEFT].measured_velocity, map);
  if (touches(channel, FaultChannel::right)) apply(message.drivers[jackal_msgs::Drive::RIGHT].measured_velocity, map);
}

void mapValues(jackal_msgs::Drive& message, FaultChannel channel, const ValueMap& map) {
  if (touches(channel, FaultChannel::left)) apply(message.drivers[jackal_msgs::Drive::LEFT], map);
  if (touches(channel, FaultChannel::right)) apply(message.drivers[jackal_msgs::Drive::RIGHT], map);
}

void mapValues(geometry_msgs::Twist& message, FaultChannel channel, const ValueMap& map) {
  if (touches(channel, FaultChannel::forward)) apply(message.linear.x, map);
  if (touches(channel, FaultChannel::yaw_rate)) apply(message.angular.z, map);
}

bool spoil(sensor_msgs::JointState& message, FaultKind kind) {
  switch (kind) {
    case FaultKind::wrong_names:
      for (auto& name : message.name) name = "unknown_" + name;
      return true;
    case FaultKind::one_side: {
      sensor_msgs::JointState kept;
      kept.header = message.header;
      for (std::size_t i = 0; i < message.name.size() && i < message.velocity.size(); ++i) {
        if (isOn(message.name[i], "right")) continue;
        kept.name.push_back(message.name[i]);
        kept.velocity.push_back(message.velocity[i]);
      }
      message = kept;
      return true;
    }
    case FaultKind::no_values:
      message.velocity.clear();
      return true;
    default:
      return false;
  }
}

bool spoil(sensor_msgs::Imu& message, FaultKind kind) {
  if (kind != FaultKind::upside_down) return false;
  turnOver(message.angular_velocity);
  turnOver(message.linear_acceleration);
  // Half a turn about the sensor's own x axis, from the right: (w, x, y, z) * (0, 1, 0, 0).
  const auto q = message.orientation;
  message.orientation.w = -q.x;
  message.orientation.x = q.w;
  message.orientation.y = q.z;
  message.orientation.z = -q.y;
  return true;
}

bool spoil(jackal_msgs::Feedback& message, FaultKind kind) {
  switch (kind) {
    case FaultKind::driver_fault:
      for (auto& driver : message.drivers) driver.driver_fault = true;
      return true;
    case FaultKind::mode_none:
      message.actual_mode = jackal_msgs::Drive::MODE_NONE;
      return true;
    default:
      return false;
  }
}

bool spoil(jackal_msgs::Status& message, FaultKind kind) {
  if (kind != FaultKind::external_stop) return false;
  message.driver_external_stop_present = true;
  message.driver_external_stop_stopped = true;
  message.drivers_active = false;
  return true;
}

}  // namespace jackal_aic::sim
