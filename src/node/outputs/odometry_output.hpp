#pragma once

/// @file
/// Odometry as a message, on the topic odom and as the transform from its frame to the base frame.

#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <tf2_ros/transform_broadcaster.h>

#include <Eigen/Core>
#include <boost/array.hpp>
#include <optional>

#include "jackal_aic/odometry/odometry.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "parameters/node_parameters.hpp"

namespace jackal_aic {

/// Variance of unknown components in a message [(m/s)^2, (rad/s)^2].
inline constexpr double kUnknownVariance = 1e6;

/// Covariance of a pose or a twist in a message: x, y, z, roll, pitch, yaw, row by row.
using Covariance = boost::array<double, 36>;

/// Fills in a covariance of the motion (x_dot, theta_dot). @param rest variance of the other speeds.
void fillMotionCovariance(const Eigen::Matrix2d& covariance, double rest, Covariance& matrix);

/// Fills in pose and motion with their covariances. @param covariance of the pose (x, y, yaw). Components that wheels
/// and gyro do not measure have kUnknownVariance.
void fillOdometry(const PlanarPose& pose, const Eigen::Matrix3d& covariance, const PlanarMotion& motion,
                  nav_msgs::Odometry& message);

/// The pose of a message as the transform between its frames.
geometry_msgs::TransformStamped transformOf(const nav_msgs::Odometry& message);

/// Computes the odometry of a drive loop and publishes it by the parameters odometry.*.
class OdometryOutput {
 public:
  /// Opens the topics in the namespace of `node`. @param parameters of the node; @param loop has to outlive the output.
  OdometryOutput(ros::NodeHandle& node, const NodeParameters& parameters, const DriveLoop& loop);

  /// The loop received a measurement at a time.
  void observe(const Observation& observation, const ros::Time& now);

  /// Advances to a time and publishes. @param applied command of the motors until now [rad/s].
  void publish(const WheelCommand& applied, const ros::Time& now);

  /// The clock jumped back.
  void reset();

 private:
  void advance(const WheelCommand& applied, const ros::Time& now);

  const DriveLoop& loop_;
  Odometry odometry_;
  ros::Time last_;
  nav_msgs::Odometry message_;
  ros::Publisher publisher_;                                  // if it is published
  std::optional<tf2_ros::TransformBroadcaster> broadcaster_;  // if the transform is published
};

}  // namespace jackal_aic
