#include "outputs/commands.hpp"

#include <std_msgs/Float64.h>

namespace jackal_aic {
namespace {

std_msgs::Float64 wheelMessage(double speed) {
  std_msgs::Float64 message;
  message.data = speed;
  return message;
}

}  // namespace

jackal_msgs::Drive driveMessage(const WheelCommand& command) {
  jackal_msgs::Drive message;
  message.mode = jackal_msgs::Drive::MODE_VELOCITY;
  message.drivers[jackal_msgs::Drive::LEFT] = static_cast<float>(command.left);
  message.drivers[jackal_msgs::Drive::RIGHT] = static_cast<float>(command.right);
  return message;
}

geometry_msgs::Twist twistMessage(const BodyVector& velocity) {
  geometry_msgs::Twist message;
  message.linear.x = velocity(kForward);
  message.angular.z = velocity(kYaw);
  return message;
}

CommandOutput::CommandOutput(ros::NodeHandle& node, OutputMode mode, const GeometryParameters& geometry)
    : mode_(mode), kinematics_(geometry) {
  switch (mode) {
    case OutputMode::cmd_drive:
      publishers_ = {node.advertise<jackal_msgs::Drive>("cmd_drive", 1)};
      break;
    case OutputMode::twist:
      publishers_ = {node.advertise<geometry_msgs::Twist>("cmd_vel", 1)};
      break;
    case OutputMode::gazebo:
      publishers_ = {node.advertise<std_msgs::Float64>("jackal_left_wheel/command", 1),
                     node.advertise<std_msgs::Float64>("jackal_right_wheel/command", 1)};
      break;
  }
}

std::vector<std::string> CommandOutput::topics() const {
  std::vector<std::string> topics;
  for (const ros::Publisher& publisher : publishers_) topics.push_back(publisher.getTopic());
  return topics;
}

std::string CommandOutput::complaint() const {
  for (const ros::Publisher& publisher : publishers_) {
    if (publisher.getNumSubscribers() > 0) continue;
    const std::string hint = mode_ == OutputMode::twist ? ": is twist_mux running?" : "";
    return "no subscriber on " + publisher.getTopic() + hint;
  }
  return "";
}

void CommandOutput::publish(const WheelCommand& command) {
  switch (mode_) {
    case OutputMode::cmd_drive:
      publishers_[0].publish(driveMessage(command));
      break;
    case OutputMode::twist:
      publishers_[0].publish(twistMessage(kinematics_.bodyVelocity(command)));
      break;
    case OutputMode::gazebo:
      publishers_[0].publish(wheelMessage(command.left));
      publishers_[1].publish(wheelMessage(command.right));
      break;
  }
}

}  // namespace jackal_aic
