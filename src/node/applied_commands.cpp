#include "applied_commands.hpp"

#include <utility>

#include "conversions.hpp"

namespace jackal_aic {

AppliedCommands::AppliedCommands(ros::NodeHandle& node, const GeometryParameters& geometry, Callback callback)
    : kinematics_(geometry), callback_(std::move(callback)) {
  const auto no_delay = ros::TransportHints().tcpNoDelay();
  drive_subscriber_ = node.subscribe("cmd_drive", 10, &AppliedCommands::onDrive, this, no_delay);
  twist_subscriber_ =
      node.subscribe("jackal_velocity_controller/cmd_vel", 10, &AppliedCommands::onTwist, this, no_delay);
}

std::vector<std::string> AppliedCommands::topics() const {
  return {drive_subscriber_.getTopic(), twist_subscriber_.getTopic()};
}

void AppliedCommands::onDrive(const jackal_msgs::Drive& message) {
  if (const auto command = wheelCommand(message)) callback_(*command, AppliedSource::drive);
}

void AppliedCommands::onTwist(const geometry_msgs::Twist& message) {
  const auto velocity = setPoint(message);
  if (velocity) callback_(kinematics_.wheelSpeeds(velocity->forward, velocity->yaw_rate), AppliedSource::twist);
}

}  // namespace jackal_aic
