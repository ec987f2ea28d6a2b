#pragma once

/// @file
/// What the robot and its user report in addition to the measurements: emergency stop, status, feedback of the motors.

#include <jackal_msgs/Feedback.h>
#include <jackal_msgs/Status.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <std_msgs/Bool.h>

#include <functional>

#include "jackal_aic/safety/drive_loop.hpp"

namespace jackal_aic {

/// Subscribes e_stop (std_msgs/Bool), status (jackal_msgs/Status) and feedback (jackal_msgs/Feedback); none of them has
/// to be there. Callbacks run in the threads of the node handle, one at a time where it has one thread.
class RobotWatch {
 public:
  /// @param on_feedback called with the stamp of each feedback that has one; @param on_message called with status()
  /// after each message that may have changed it.
  RobotWatch(
      ros::NodeHandle& node, std::function<void(const ros::Time&)> on_feedback,
      std::function<void(const RobotStatus&)> on_message = [](const RobotStatus&) {});

  /// What they said last; contention and end of the controller are left to the caller.
  const RobotStatus& status() const { return status_; }

  /// The emergency stop: its topic, as resolved, and its publishers that are connected.
  const ros::Subscriber& emergencyStop() const { return emergency_stop_subscriber_; }

  /// Forgets the messages; the emergency stop, which is sent once, and the robot's own stop stay.
  void reset() { status_.motors_off = status_.driver_fault = false; }

 private:
  void onEmergencyStop(const std_msgs::Bool& message);
  void onStatus(const jackal_msgs::Status& message);
  void onFeedback(const jackal_msgs::Feedback& message);

  std::function<void(const ros::Time&)> on_feedback_;
  std::function<void(const RobotStatus&)> on_message_;
  RobotStatus status_;
  ros::Subscriber emergency_stop_subscriber_;
  ros::Subscriber status_subscriber_;
  ros::Subscriber feedback_subscriber_;
};

}  // namespace jackal_aic
