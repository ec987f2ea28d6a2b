#pragma once

/// @file
/// ROS messages of the simulated robot: pure conversions.

#include <geometry_msgs/TransformStamped.h>
#include <jackal_msgs/Feedback.h>
#include <nav_msgs/Odometry.h>
#include <ros/time.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>

#include <cstdint>

#include "jackal_plant.hpp"

namespace jackal_aic::sim {

/// Stamp of a simulated time [s]: one step later than the plant's own time, because a stamp of 0 means "no time" in
/// ROS.
ros::Time stampOf(double plant_time);

/// joint_states: the four wheels by their stock names.
sensor_msgs::JointState toJointState(const PlantMeasurement& measurement);

/// imu/data, frame imu_link; the covariances are those of the plant's noise; the orientation has none.
sensor_msgs::Imu toImu(const ImuMeasurement& measurement, const PlantParameters& parameters);

/// feedback: wheel speed and travel per side, stamped with the time at which they were measured; currents and
/// temperatures, which the plant does not model, are 0.
/// @param mode the last commanded mode, a constant of jackal_msgs/Drive.
jackal_msgs::Feedback toFeedback(const PlantMeasurement& measurement, std::int8_t mode);

/// ground_truth/odom: base_link in odom (the plant's ground frame), twist in base_link, free of noise.
nav_msgs::Odometry toOdometry(const PlantTruth& truth);

/// Transform from odom to base_link.
geometry_msgs::TransformStamped toTransform(const PlantTruth& truth);

}  // namespace jackal_aic::sim
