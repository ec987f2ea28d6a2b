#pragma once

/// @file
/// What the robot and its user report in addition to the measurements: emergency stop, status and feedback of the
/// motors, and the commands that reach the motors behind twist_mux.

#include <geometry_msgs/Twist.h>
#include <jackal_msgs/Drive.h>
#include <jackal_msgs/Feedback.h>
#include <jackal_msgs/Status.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <std_msgs/Bool.h>

#include <array>
#include <functional>
#include <optional>

#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/safety/drive_input.hpp"

namespace jackal_aic {

/// Copies the robot's stop from a message.
void takeStatus(const jackal_msgs::Status& message, RobotStatus& status);

/// Copies mode and faults of the motors from a message.
void takeFeedback(const jackal_msgs::Feedback& message, RobotStatus& status);

/// Wheel speeds of a drive message, zero in another mode than velocity. std::nullopt if one is not finite.
std::optional<WheelCommand> wheelCommand(const jackal_msgs::Drive& message);

/// Subscribes e_stop (std_msgs/Bool), status (jackal_msgs/Status) and feedback (jackal_msgs/Feedback); each is
/// optional. Callbacks run in the threads of the node handle, one at a time where it has one thread.
class RobotReports {
 public:
  /// @param on_feedback called with the stamp of each feedback that has one; @param on_message called with status()
  /// after each message that may have changed it.
  RobotReports(
      ros::NodeHandle& node, std::function<void(const ros::Time&)> on_feedback,
      std::function<void(const RobotStatus&)> on_message = [](const RobotStatus&) {});

  /// Latest status; the caller adds contention and the end of the controller.
  const RobotStatus& status() const { return status_; }

  /// Of the emergency stop.
  const ros::Subscriber& emergencyStop() const { return subscribers_[0]; }

  /// Forgets the messages; the emergency stop, which is sent once, and the robot's own stop remain.
  void reset() { status_.motors_off = status_.driver_fault = false; }

 private:
  RobotStatus status_;
  std::array<ros::Subscriber, 3> subscribers_;  // of e_stop, status and feedback
};

/// Listens to cmd_drive (jackal_msgs/Drive), which the stock jackal_node publishes without pause. Where that is absent,
/// as in Gazebo, it listens to jackal_velocity_controller/cmd_vel (geometry_msgs/Twist), the output of twist_mux.
/// @param geometry turns a Twist into wheel speeds; @param callback called with each command and its source.
std::array<ros::Subscriber, 2> subscribeToApplied(
    ros::NodeHandle& node, const GeometryParameters& geometry,
    const std::function<void(const WheelCommand&, AppliedSource)>& callback);

}  // namespace jackal_aic
