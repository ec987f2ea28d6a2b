#pragma once

/// @file
/// What the robot and its user say beside the measurements: emergency stop, status, feedback of the motors, and sources
/// that repeat themselves.

#include <jackal_msgs/Feedback.h>
#include <jackal_msgs/Status.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Bool.h>

#include <functional>

#include "jackal_aic/frozen_source.hpp"
#include "jackal_aic/gate_parameters.hpp"
#include "jackal_aic/stop_cause.hpp"
#include "jackal_aic/types.hpp"
#include "node_parameters.hpp"
#include "sensor_pairing.hpp"

namespace jackal_aic {

/// Subscribes e_stop (std_msgs/Bool), status (jackal_msgs/Status) and feedback (jackal_msgs/Feedback); none of them has
/// to be there. All callbacks run in the thread of the node.
class RobotWatch {
 public:
  /// @param now the node's view of the time.
  RobotWatch(ros::NodeHandle& node, const RobotNames& names, const DeadlineParameters& deadlines,
             std::function<ros::Time()> now);

  /// Looks whether accepted wheel speeds are alive. @param command wheel speeds now driven [rad/s]: encoders at rest
  /// may repeat, on the move they may not.
  void addWheels(const sensor_msgs::JointState& message, const ros::Time& now, const WheelCommand& command);

  /// Looks whether an accepted IMU message is alive.
  void addImu(const sensor_msgs::Imu& message, const ros::Time& now);

  /// Adds what keeps the robot from driving.
  void addCauses(StopCauses& causes) const;

  /// Last accepted wheel speeds [rad/s]; zero before the first.
  const WheelCommand& wheelSpeeds() const { return wheel_speeds_; }

  /// Last feedback of the motors that had a stamp.
  const SensorPairing::Arrival& feedback() const { return feedback_arrival_; }

  /// Forgets the messages; the emergency stop, which is sent once, and the robot's own stop stay.
  void reset();

 private:
  void onEmergencyStop(const std_msgs::Bool& message) { emergency_stop_ = message.data; }
  void onStatus(const jackal_msgs::Status& message);
  void onFeedback(const jackal_msgs::Feedback& message);

  RobotNames names_;
  std::function<ros::Time()> now_;
  FrozenSource wheels_;
  FrozenSource imu_;
  WheelCommand wheel_speeds_;
  SensorPairing::Arrival feedback_arrival_;
  bool emergency_stop_ = false;
  bool robot_stopped_ = false;
  bool motors_off_ = false;
  bool driver_fault_ = false;
  ros::Subscriber emergency_stop_subscriber_;
  ros::Subscriber status_subscriber_;
  ros::Subscriber feedback_subscriber_;
};

}  // namespace jackal_aic
