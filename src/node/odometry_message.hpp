#pragma once

/// @file
/// Odometry beside any controller, and as a message.

#include <nav_msgs/Odometry.h>

#include <Eigen/Core>

#include "jackal_aic/odometry/odometry.hpp"
#include "jackal_aic/safety/drive_loop.hpp"

namespace jackal_aic {

/// Odometry by the belief of a controller, or by one of its own where that is biased or missing. @param controller as
/// makeController(parameters) made it; it has to outlive the odometry.
Odometry makeOdometry(const DriveParameters& parameters, const VelocityController& controller);

/// Fills in pose, motion and, if they are wanted, their covariances. A robot on wheels that does not slide has no
/// sideways speed: its variance is the stock Jackal's 0.001. What wheels and gyro say nothing about has 1e6.
void fillPose(const PlanarPose& pose, nav_msgs::Odometry& message);
void fillMotion(const PlanarMotion& motion, nav_msgs::Odometry& message);
void fillPoseCovariance(const Eigen::Matrix3d& covariance, nav_msgs::Odometry& message);
void fillMotionCovariance(const Eigen::Matrix2d& covariance, nav_msgs::Odometry& message);

}  // namespace jackal_aic
