#include "outputs/commands.hpp"

#include <std_msgs/Float64.h>

namespace jackal_aic {
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
  const auto advertise = [&](auto message, const char* topic) {
    publishers_.push_back(node.advertise<decltype(message)>(topic, 1));
  };
  if (mode == OutputMode::cmd_drive) advertise(jackal_msgs::Drive(), "cmd_drive");
  if (mode == OutputMode::twist) advertise(geometry_msgs::Twist(), "cmd_vel");
  if (mode != OutputMode::gazebo) return;
  advertise(std_msgs::Float64(), "jackal_left_wheel/command");
  advertise(std_msgs::Float64(), "jackal_right_wheel/command");
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
  if (mode_ == OutputMode::cmd_drive) publishers_[0].publish(driveMessage(command));
  if (mode_ == OutputMode::twist) publishers_[0].publish(twistMessage(kinematics_.bodyVelocity(command)));
  for (Eigen::Index side = 0; mode_ == OutputMode::gazebo && side < 2; ++side) {
    std_msgs::Float64 message;
    message.data = command.vector()(side);
    publishers_[static_cast<std::size_t>(side)].publish(message);
  }
}

}  // namespace jackal_aic
