#pragma once

/// @file
/// Listens to what reaches the motors, where twist_mux decides whose commands do.

#include <geometry_msgs/Twist.h>
#include <jackal_msgs/Drive.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>

#include <functional>
#include <string>
#include <vector>

#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/safety/motor_share.hpp"

namespace jackal_aic {

/// Listens to cmd_drive (jackal_msgs/Drive), which the stock jackal_node publishes without pause. Where that is absent,
/// as in Gazebo, it listens to jackal_velocity_controller/cmd_vel (geometry_msgs/Twist), the output of twist_mux.
class AppliedCommands {
 public:
  /// Called with each command and where it was heard.
  using Callback = std::function<void(const WheelCommand&, AppliedSource)>;

  /// Subscribes in the namespace of `node`.
  AppliedCommands(ros::NodeHandle& node, const GeometryParameters& geometry, Callback callback);

  /// Topics that it listens to: a set point that came from there would be our own command.
  std::vector<std::string> topics() const;

 private:
  void onDrive(const jackal_msgs::Drive& message);
  void onTwist(const geometry_msgs::Twist& message);

  SkidSteerKinematics kinematics_;
  Callback callback_;
  ros::Subscriber drive_subscriber_;
  ros::Subscriber twist_subscriber_;
};

}  // namespace jackal_aic
