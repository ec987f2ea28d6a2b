#pragma once

/// @file
/// The topics that wheel commands leave on.

#include <geometry_msgs/Twist.h>
#include <jackal_msgs/Drive.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>

#include <string>
#include <vector>

#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "jackal_aic/model/types.hpp"
#include "parameters/node_parameters.hpp"

namespace jackal_aic {

/// Drive message in velocity mode.
jackal_msgs::Drive driveMessage(const WheelCommand& command);

/// Body velocity as a Twist (linear.x, angular.z).
geometry_msgs::Twist twistMessage(const BodyVector& velocity);

/// Publishes wheel commands on the topics of the chosen output mode.
class CommandOutput {
 public:
  /// Advertises the topics: cmd_drive, cmd_vel, or jackal_left_wheel/command and jackal_right_wheel/command.
  /// @param geometry robot whose body velocity a Twist is.
  CommandOutput(ros::NodeHandle& node, OutputMode mode, const GeometryParameters& geometry);

  /// The topics with their resolved names.
  std::vector<std::string> topics() const;

  /// Names the topic without a subscriber; empty if each has one. Thread-safe.
  std::string complaint() const;

  /// Publishes wheel speeds [rad/s].
  void publish(const WheelCommand& command);

 private:
  OutputMode mode_;
  SkidSteerKinematics kinematics_;
  std::vector<ros::Publisher> publishers_;
};

}  // namespace jackal_aic
