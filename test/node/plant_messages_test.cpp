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

TEST(PlantMessages, HaveTheNumbersOfTheMeasurement) {
  EXPECT_EQ(stampOf(0.0), ros::Time(0, 1000000)) << "none is zero";
  EXPECT_EQ(stampOf(1.999), ros::Time(2, 0));
  const sensor_msgs::JointState joints = toJointState(measurement());
  EXPECT_EQ(joints.header.stamp, ros::Time(0, 21000000));
  EXPECT_EQ(joints.name,
            (std::vector<std::string>{"front_left_wheel", "front_right_wheel", "rear_left_wheel", "rear_right_wheel"}));
  EXPECT_EQ(joints.velocity, (std::vector<double>{5.0, 6.0, 7.0, 8.0}));
  const jackal_msgs::Feedback feedback = toFeedback(measurement(), jackal_msgs::Drive::MODE_VELOCITY);
  EXPECT_EQ(feedback.header.stamp, ros::Time(0, 20000000)) << "when it was measured";
  EXPECT_EQ(feedback.drivers[jackal_msgs::Drive::LEFT].measured_velocity, 5.0f);
  EXPECT_EQ(feedback.drivers[jackal_msgs::Drive::RIGHT].measured_velocity, 6.0f);
  EXPECT_EQ(feedback.actual_mode, jackal_msgs::Drive::MODE_VELOCITY);
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
  EXPECT_EQ(message.orientation.y, 0.7);
  for (int i = 0; i < 9; ++i) {
    EXPECT_NEAR(message.angular_velocity_covariance[i], i % 4 == 0 ? 0.0004 : 0.0, 1e-12);
    EXPECT_NEAR(message.linear_acceleration_covariance[i], i % 4 == 0 ? 0.04 : 0.0, 1e-12);
  }
}

}  // namespace
}  // namespace jackal_aic::sim
