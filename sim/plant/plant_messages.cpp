#include "plant_messages.hpp"

#include <jackal_msgs/Drive.h>

#include <cmath>

namespace jackal_aic::sim {
namespace {

constexpr const char* kOdomFrame = "odom";
constexpr const char* kBaseFrame = "base_link";
constexpr const char* kImuFrame = "imu_link";

/// Any message with x, y and z.
template <class Message>
void assign(Message& message, const Eigen::Vector3d& vector) {
  message.x = vector.x();
  message.y = vector.y();
  message.z = vector.z();
}

void assign(geometry_msgs::Quaternion& message, const Eigen::Quaterniond& rotation) {
  message.w = rotation.w();
  message.x = rotation.x();
  message.y = rotation.y();
  message.z = rotation.z();
}

void setDiagonal(boost::array<double, 9>& covariance, double deviation) {
  covariance.fill(0.0);
  covariance[0] = covariance[4] = covariance[8] = deviation * deviation;
}

jackal_msgs::DriveFeedback driverOf(const PlantMeasurement& measurement, Wheel wheel) {
  jackal_msgs::DriveFeedback driver;
  driver.measured_velocity = static_cast<float>(measurement.wheel_velocity[wheel]);
  driver.measured_travel = static_cast<float>(measurement.wheel_position[wheel]);
  return driver;
}

}  // namespace

ros::Time stampOf(double plant_time) {
  ros::Time stamp;
  return stamp.fromNSec(static_cast<std::uint64_t>(std::llround((plant_time + JackalPlant::kStep) * 1e9)));
}

sensor_msgs::JointState toJointState(const PlantMeasurement& measurement) {
  sensor_msgs::JointState message;
  message.header.stamp = stampOf(measurement.stamp);
  message.name.assign(kWheelJoints.begin(), kWheelJoints.end());
  message.position.assign(measurement.wheel_position.begin(), measurement.wheel_position.end());
  message.velocity.assign(measurement.wheel_velocity.begin(), measurement.wheel_velocity.end());
  message.effort.assign(measurement.wheel_effort.begin(), measurement.wheel_effort.end());
  return message;
}

sensor_msgs::Imu toImu(const ImuMeasurement& measurement, const PlantParameters& parameters) {
  sensor_msgs::Imu message;
  message.header.stamp = stampOf(measurement.stamp);
  message.header.frame_id = kImuFrame;
  assign(message.orientation, measurement.orientation);
  assign(message.angular_velocity, measurement.angular_velocity);
  assign(message.linear_acceleration, measurement.linear_acceleration);
  // All zeros would mean that the covariance is unknown.
  setDiagonal(message.orientation_covariance, 1e-6);
  setDiagonal(message.angular_velocity_covariance, parameters.noise_scale * parameters.gyro_noise);
  setDiagonal(message.linear_acceleration_covariance, parameters.noise_scale * parameters.accelerometer_noise);
  return message;
}

jackal_msgs::Feedback toFeedback(const PlantMeasurement& measurement, std::int8_t mode) {
  jackal_msgs::Feedback message;
  message.header.stamp = stampOf(measurement.feedback_stamp);
  message.drivers[jackal_msgs::Drive::LEFT] = driverOf(measurement, kFrontLeft);
  message.drivers[jackal_msgs::Drive::RIGHT] = driverOf(measurement, kFrontRight);
  message.commanded_mode = mode;
  message.actual_mode = mode;
  return message;
}

nav_msgs::Odometry toOdometry(const PlantTruth& truth) {
  nav_msgs::Odometry message;
  message.header.stamp = stampOf(truth.time);
  message.header.frame_id = kOdomFrame;
  message.child_frame_id = kBaseFrame;
  assign(message.pose.pose.position, truth.position);
  assign(message.pose.pose.orientation, truth.orientation);
  assign(message.twist.twist.linear, truth.linear_velocity);
  assign(message.twist.twist.angular, truth.angular_velocity);
  return message;
}

geometry_msgs::TransformStamped toTransform(const PlantTruth& truth) {
  geometry_msgs::TransformStamped message;
  message.header.stamp = stampOf(truth.time);
  message.header.frame_id = kOdomFrame;
  message.child_frame_id = kBaseFrame;
  assign(message.transform.translation, truth.position);
  assign(message.transform.rotation, truth.orientation);
  return message;
}

}  // namespace jackal_aic::sim
