#include "plant_messages.hpp"

#include <gtest/gtest.h>
#include <jackal_msgs/Drive.h>

#include <string>
#include <vector>

namespace jackal_aic::sim {
namespace {

PlantMeasurement measurement() {
  PlantMeasurement m;
  m.stamp = 0.02;
  m.feedback_stamp = 0.019;
  m.wheel_position = {1.0, 2.0, 3.0, 4.0};
  m.wheel_velocity = {5.0, 6.0, 7.0, 8.0};
  m.wheel_effort = {0.1, 0.2, 0.3, 0.4};
  m.angular_velocity = {0.1, 0.2, 0.3};
  m.linear_acceleration = {1.0, 2.0, 9.81};
  m.orientation = Eigen::Quaterniond(0.5, 0.1, 0.7, 0.5);
  return m;
}

TEST(PlantMessages, StampsAreOneStepAheadSoThatNoneIsZero) {
  EXPECT_EQ(stampOf(0.0), ros::Time(0, 1000000));
  EXPECT_EQ(stampOf(1.999), ros::Time(2, 0));
}

TEST(PlantMessages, JointStateNamesEachWheel) {
  const sensor_msgs::JointState message = toJointState(measurement());
  EXPECT_EQ(message.header.stamp, ros::Time(0, 21000000));
  EXPECT_EQ(message.name,
            (std::vector<std::string>{"front_left_wheel", "front_right_wheel", "rear_left_wheel", "rear_right_wheel"}));
  EXPECT_EQ(message.position, (std::vector<double>{1.0, 2.0, 3.0, 4.0}));
  EXPECT_EQ(message.velocity, (std::vector<double>{5.0, 6.0, 7.0, 8.0}));
  EXPECT_EQ(message.effort, (std::vector<double>{0.1, 0.2, 0.3, 0.4}));
}

TEST(PlantMessages, ImuStatesItsNoise) {
  PlantParameters parameters;
  parameters.noise_scale = 2.0;
  parameters.gyro_noise = 0.01;
  parameters.accelerometer_noise = 0.1;
  const sensor_msgs::Imu message = toImu(measurement(), parameters);
  EXPECT_EQ(message.header.frame_id, "imu_link");
  EXPECT_EQ(message.angular_velocity.z, 0.3);
  EXPECT_EQ(message.linear_acceleration.x, 1.0);
  EXPECT_EQ(message.linear_acceleration.z, 9.81);
  EXPECT_EQ(message.orientation.w, 0.5);
  EXPECT_EQ(message.orientation.y, 0.7);
  for (int i = 0; i < 9; ++i) {
    EXPECT_NEAR(message.angular_velocity_covariance[i], i % 4 == 0 ? 0.0004 : 0.0, 1e-12);
    EXPECT_NEAR(message.linear_acceleration_covariance[i], i % 4 == 0 ? 0.04 : 0.0, 1e-12);
  }
}

TEST(PlantMessages, FeedbackHasOneDriverPerSide) {
  const jackal_msgs::Feedback message = toFeedback(measurement(), jackal_msgs::Drive::MODE_VELOCITY);
  EXPECT_EQ(message.header.stamp, ros::Time(0, 20000000)) << "when it was measured";
  EXPECT_EQ(message.drivers[jackal_msgs::Drive::LEFT].measured_velocity, 5.0f);
  EXPECT_EQ(message.drivers[jackal_msgs::Drive::RIGHT].measured_velocity, 6.0f);
  EXPECT_EQ(message.drivers[jackal_msgs::Drive::RIGHT].measured_travel, 2.0f);
  EXPECT_EQ(message.actual_mode, jackal_msgs::Drive::MODE_VELOCITY);
}

TEST(PlantMessages, OdometryAndTransformAgree) {
  PlantTruth truth;
  truth.time = 1.0;
  truth.position = {1.0, 2.0, 3.0};
  truth.orientation = Eigen::Quaterniond(0.5, 0.1, 0.7, 0.5);
  truth.linear_velocity = {0.5, 0.1, 0.2};
  truth.angular_velocity = {0.1, 0.2, 0.3};
  const nav_msgs::Odometry odometry = toOdometry(truth);
  const geometry_msgs::TransformStamped transform = toTransform(truth);
  EXPECT_EQ(odometry.header.frame_id, "odom");
  EXPECT_EQ(odometry.child_frame_id, "base_link");
  EXPECT_EQ(odometry.twist.twist.linear.x, 0.5);
  EXPECT_EQ(odometry.twist.twist.angular.z, 0.3);
  EXPECT_EQ(odometry.pose.pose.position.y, 2.0);
  EXPECT_EQ(transform.transform.translation.y, 2.0);
  EXPECT_EQ(transform.transform.rotation, odometry.pose.pose.orientation);
  EXPECT_EQ(transform.header, odometry.header);
  EXPECT_EQ(transform.child_frame_id, odometry.child_frame_id);
}

}  // namespace
}  // namespace jackal_aic::sim
