#pragma once

/// @file
/// Odometry as a message.

#include <nav_msgs/Odometry.h>

#include <Eigen/Core>

#include "jackal_aic/odometry/dead_reckoning.hpp"

namespace jackal_aic {

/// Fills in pose, motion and, if they are wanted, their covariances. A robot on wheels that does not slide has no
/// sideways speed: its variance is the stock Jackal's 0.001. What wheels and gyro say nothing about has 1e6.
void fillPose(const PlanarPose& pose, nav_msgs::Odometry& message);
void fillMotion(const PlanarMotion& motion, nav_msgs::Odometry& message);
void fillPoseCovariance(const Eigen::Matrix3d& covariance, nav_msgs::Odometry& message);
void fillMotionCovariance(const Eigen::Matrix2d& covariance, nav_msgs::Odometry& message);

}  // namespace jackal_aic
