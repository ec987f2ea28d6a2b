#include "inputs/robot_status.hpp"

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
                           std::function<void(const RobotStatus&)> on_message) {
  const auto no_delay = ros::TransportHints().tcpNoDelay();
  subscribers_[0] = node.subscribe<std_msgs::Bool>(
      "e_stop", 10,
      [this, on_message](const std_msgs::BoolConstPtr& message) {
        status_.emergency_stop = message->data;
        on_message(status_);
      },
      {}, no_delay);
  subscribers_[1] = node.subscribe<jackal_msgs::Status>(
      "status", 10,
      [this, on_message](const jackal_msgs::StatusConstPtr& message) {
        takeStatus(*message, status_);
        on_message(status_);
      },
      {}, no_delay);
  subscribers_[2] = node.subscribe<jackal_msgs::Feedback>(
      "feedback", 50,
      [this, on_feedback, on_message](const jackal_msgs::FeedbackConstPtr& message) {
        if (message->header.stamp.isZero()) return;
        on_feedback(message->header.stamp);
        takeFeedback(*message, status_);
        on_message(status_);
      },
      {}, no_delay);
}

AppliedCommands::AppliedCommands(ros::NodeHandle& node, const GeometryParameters& geometry, const Callback& callback) {
  const auto no_delay = ros::TransportHints().tcpNoDelay();
  drive_subscriber_ = node.subscribe<jackal_msgs::Drive>(
      "cmd_drive", 10,
      [callback](const jackal_msgs::DriveConstPtr& message) {
        if (const auto command = wheelCommand(*message)) callback(*command, AppliedSource::drive);
      },
      {}, no_delay);
  twist_subscriber_ = node.subscribe<geometry_msgs::Twist>(
      "jackal_velocity_controller/cmd_vel", 10,
      [callback, kinematics = SkidSteerKinematics(geometry)](const geometry_msgs::TwistConstPtr& message) {
        const auto v = setPoint(*message);
        if (v) callback(kinematics.wheelSpeeds(v->forward, v->yaw_rate), AppliedSource::twist);
      },
      {}, no_delay);
}

}  // namespace jackal_aic
