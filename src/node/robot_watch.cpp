#include "robot_watch.hpp"

#include <utility>

#include "conversions.hpp"

namespace jackal_aic {

RobotWatch::RobotWatch(ros::NodeHandle& node, std::function<void(const ros::Time&)> on_feedback,
                       std::function<void(const RobotStatus&)> on_message)
    : on_feedback_(std::move(on_feedback)), on_message_(std::move(on_message)) {
  const auto no_delay = ros::TransportHints().tcpNoDelay();
  emergency_stop_subscriber_ = node.subscribe("e_stop", 10, &RobotWatch::onEmergencyStop, this, no_delay);
  status_subscriber_ = node.subscribe("status", 10, &RobotWatch::onStatus, this, no_delay);
  feedback_subscriber_ = node.subscribe("feedback", 50, &RobotWatch::onFeedback, this, no_delay);
}

void RobotWatch::onEmergencyStop(const std_msgs::Bool& message) {
  status_.emergency_stop = message.data;
  on_message_(status_);
}

void RobotWatch::onStatus(const jackal_msgs::Status& message) {
  takeStatus(message, status_);
  on_message_(status_);
}

void RobotWatch::onFeedback(const jackal_msgs::Feedback& message) {
  if (message.header.stamp.isZero()) return;
  on_feedback_(message.header.stamp);
  takeFeedback(message, status_);
  on_message_(status_);
}

}  // namespace jackal_aic
