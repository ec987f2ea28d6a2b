#include "command_output.hpp"

#include <std_msgs/Float64.h>

#include "conversions.hpp"

namespace jackal_aic {
namespace {

std_msgs::Float64 wheelMessage(double speed) {
  std_msgs::Float64 message;
  message.data = speed;
  return message;
}

}  // namespace

CommandOutput::CommandOutput(ros::NodeHandle& node, OutputMode mode) : mode_(mode) {
  if (mode == OutputMode::cmd_drive) {
    drive_ = node.advertise<jackal_msgs::Drive>("cmd_drive", 1);
  } else {
    left_ = node.advertise<std_msgs::Float64>("jackal_left_wheel/command", 1);
    right_ = node.advertise<std_msgs::Float64>("jackal_right_wheel/command", 1);
  }
}

void CommandOutput::publish(const WheelCommand& command) {
  if (mode_ == OutputMode::cmd_drive) {
    drive_.publish(driveMessage(command));
  } else {
    left_.publish(wheelMessage(command.left));
    right_.publish(wheelMessage(command.right));
  }
}

}  // namespace jackal_aic
