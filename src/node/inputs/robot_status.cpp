#include "inputs/robot_status.hpp"

#include "inputs/set_points.hpp"

namespace jackal_aic {
namespace {

template <class Message>
ros::Subscriber subscribe(ros::NodeHandle& node, const char* topic, std::uint32_t queue,
                          const std::function<void(const Message&)>& take) {
  const auto call = [take](const boost::shared_ptr<const Message>& message) { take(*message); };
  return node.subscribe<Message>(topic, queue, call, {}, ros::TransportHints().tcpNoDelay());
}

}  // namespace

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
  subscribers_[0] = subscribe<std_msgs::Bool>(node, "e_stop", 10, [=](const std_msgs::Bool& message) {
    status_.emergency_stop = message.data;
    on_message(status_);
  });
  subscribers_[1] = subscribe<jackal_msgs::Status>(node, "status", 10, [=](const jackal_msgs::Status& message) {
    takeStatus(message, status_);
    on_message(status_);
  });
  subscribers_[2] = subscribe<jackal_msgs::Feedback>(node, "feedback", 50, [=](const jackal_msgs::Feedback& message) {
    if (message.header.stamp.isZero()) return;
    on_feedback(message.header.stamp);
    takeFeedback(message, status_);
    on_message(status_);
  });
}

std::array<ros::Subscriber, 2> subscribeToApplied(
    ros::NodeHandle& node, const GeometryParameters& geometry,
    const std::function<void(const WheelCommand&, AppliedSource)>& callback) {
  const SkidSteerKinematics kinematics(geometry);
  const auto drive = [callback](const jackal_msgs::Drive& message) {
    if (const auto command = wheelCommand(message)) callback(*command, AppliedSource::drive);
  };
  const auto twist = [callback, kinematics](const geometry_msgs::Twist& message) {
    const SetPoint v = setPoint(message);
    if (v.vector().allFinite()) callback(kinematics.wheelSpeeds(v.forward, v.yaw_rate), AppliedSource::twist);
  };
  return {subscribe<jackal_msgs::Drive>(node, "cmd_drive", 10, drive),
          subscribe<geometry_msgs::Twist>(node, "jackal_velocity_controller/cmd_vel", 10, twist)};
}

}  // namespace jackal_aic
