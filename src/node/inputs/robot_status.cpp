#include "inputs/robot_status.hpp"

#include <utility>

#include "inputs/set_points.hpp"

namespace jackal_aic {

void takeStatus(const jackal_msgs::Status& message, RobotStatus& status) {
  const bool stopped = message.driver_external_stop_present && message.driver_external_stop_stopped;
  status.robot_stopped = stopped || !message.drivers_active;
}

void takeFeedback(const jackal_msgs::Feedback& message, RobotStatus& status) {
  status.motors_off = message.commanded_mode == jackal_msgs::Drive::MODE_VELOCITY &&
                      message.actual_mode != jackal_msgs::Drive::MODE_VELOCITY;
  status.driver_fault = message.drivers[0].driver_fault || message.drivers[1].driver_fault;
}

std::optional<WheelCommand> wheelCommand(const jackal_msgs::Drive& message) {
  if (message.mode != jackal_msgs::Drive::MODE_VELOCITY) return WheelCommand{};
  const WheelCommand command{message.drivers[jackal_msgs::Drive::LEFT], message.drivers[jackal_msgs::Drive::RIGHT]};
  return command.vector().allFinite() ? std::optional<WheelCommand>(command) : std::nullopt;
}

RobotReports::RobotReports(ros::NodeHandle& node, std::function<void(const ros::Time&)> on_feedback,
                           std::function<void(const RobotStatus&)> on_message)
    : on_feedback_(std::move(on_feedback)), on_message_(std::move(on_message)) {
  const auto no_delay = ros::TransportHints().tcpNoDelay();
  emergency_stop_subscriber_ = node.subscribe("e_stop", 10, &RobotReports::onEmergencyStop, this, no_delay);
  status_subscriber_ = node.subscribe("status", 10, &RobotReports::onStatus, this, no_delay);
  feedback_subscriber_ = node.subscribe("feedback", 50, &RobotReports::onFeedback, this, no_delay);
}

void RobotReports::onEmergencyStop(const std_msgs::Bool& message) {
  status_.emergency_stop = message.data;
  on_message_(status_);
}

void RobotReports::onStatus(const jackal_msgs::Status& message) {
  takeStatus(message, status_);
  on_message_(status_);
}

void RobotReports::onFeedback(const jackal_msgs::Feedback& message) {
  if (message.header.stamp.isZero()) return;
  on_feedback_(message.header.stamp);
  takeFeedback(message, status_);
  on_message_(status_);
}

AppliedCommands::AppliedCommands(ros::NodeHandle& node, const GeometryParameters& geometry, Callback callback)
    : kinematics_(geometry), callback_(std::move(callback)) {
  const auto no_delay = ros::TransportHints().tcpNoDelay();
  drive_subscriber_ = node.subscribe("cmd_drive", 10, &AppliedCommands::onDrive, this, no_delay);
  twist_subscriber_ =
      node.subscribe("jackal_velocity_controller/cmd_vel", 10, &AppliedCommands::onTwist, this, no_delay);
}

void AppliedCommands::onDrive(const jackal_msgs::Drive& message) {
  if (const auto command = wheelCommand(message)) callback_(*command, AppliedSource::drive);
}

void AppliedCommands::onTwist(const geometry_msgs::Twist& message) {
  const auto velocity = setPoint(message);
  if (velocity) callback_(kinematics_.wheelSpeeds(velocity->forward, velocity->yaw_rate), AppliedSource::twist);
}

}  // namespace jackal_aic
