#pragma once

/// @file
/// Odometry of the node: topic odom, and the transform from its frame to the base frame.

#include <nav_msgs/Odometry.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <tf2_ros/transform_broadcaster.h>

#include <optional>

#include "jackal_aic/odometry/odometry.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "node_parameters.hpp"

namespace jackal_aic {

/// Computes the odometry of a drive loop and publishes it as the parameters odometry.* say.
class OdometryOutput {
 public:
  /// Opens the topics in the namespace of `node`. @param loop has to outlive the output.
  OdometryOutput(ros::NodeHandle& node, const NodeParameters& parameters, const DriveLoop& loop);

  /// The loop was given a measurement at a time.
  void observe(const Observation& observation, const ros::Time& now);

  /// Goes on to a time and publishes. @param applied the command that the motors had until now [rad/s].
  void publish(const WheelCommand& applied, const ros::Time& now);

  /// The clock jumped back.
  void reset();

 private:
  void advance(const WheelCommand& applied, const ros::Time& now);
  void publishTransform();

  const DriveLoop& loop_;
  Odometry odometry_;
  ros::Time last_;
  nav_msgs::Odometry message_;
  ros::Publisher publisher_;                                  // if it is to be published
  std::optional<tf2_ros::TransformBroadcaster> broadcaster_;  // if the transform is
};

}  // namespace jackal_aic
