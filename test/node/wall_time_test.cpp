// The timers on wall time. The robot is ideal and lives in the test: it does at once what /cmd_drive says.

#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <jackal_aic/ControllerState.h>
#include <jackal_msgs/Drive.h>
#include <ros/ros.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>

#include <vector>

#include "jackal_aic/model/skid_steer_kinematics.hpp"

namespace jackal_aic::test {
namespace {

class IdealRobot {
 public:
  IdealRobot() {
    wheels_ = node_.advertise<sensor_msgs::JointState>("joint_states", 10);
    imu_ = node_.advertise<sensor_msgs::Imu>("imu/data", 10);
    set_point_ = node_.advertise<geometry_msgs::Twist>("jackal_AIC/set_point", 10);
    drive_ = node_.subscribe("cmd_drive", 10, &IdealRobot::onDrive, this);
    state_ = node_.subscribe("jackal_AIC/state", 100, &IdealRobot::onState, this);
    timer_ = node_.createTimer(ros::Duration(0.02), &IdealRobot::onTimer, this);
  }

  std::vector<ControllerState> states;
  WheelCommand wheels;

 private:
  void onDrive(const jackal_msgs::Drive& drive) { wheels = {drive.drivers[0], drive.drivers[1]}; }
  void onState(const ControllerState& state) { states.push_back(state); }

  void onTimer(const ros::TimerEvent&) {
    geometry_msgs::Twist twist;
    driven_ = driven_ || (!states.empty() && states.back().status == ControllerState::DRIVING);
    twist.linear.x = driven_ ? 0.5 : 0.0;  // zero first releases the latch of the start
    twist.angular.z = driven_ ? 0.4 : 0.0;
    set_point_.publish(twist);

    sensor_msgs::JointState joints;
    joints.header.stamp = ros::Time::now();
    joints.name = {"rear_right_wheel", "front_left_wheel"};
    joints.velocity = {wheels.right, wheels.left};
    wheels_.publish(joints);

    sensor_msgs::Imu imu;
    imu.header.stamp = joints.header.stamp;
    imu.header.frame_id = "base_link";
    imu.angular_velocity.z = kinematics_.bodyVelocity(wheels)(kYaw);
    imu_.publish(imu);
  }

  SkidSteerKinematics kinematics_{GeometryParameters{}};
  ros::NodeHandle node_;
  ros::Publisher wheels_, imu_, set_point_;
  ros::Subscriber drive_, state_;
  ros::Timer timer_;
  bool driven_ = false;
};

TEST(WallTime, DrivesAnIdealRobotToTheSetPoint) {
  IdealRobot robot;
  const ros::WallTime patience = ros::WallTime::now() + ros::WallDuration(60.0);
  while (robot.states.size() < 300 && ros::WallTime::now() < patience) {
    ros::spinOnce();
    ros::WallDuration(0.001).sleep();
  }
  ASSERT_GE(robot.states.size(), 300u) << "no action updates on wall time";
  const ControllerState& last = robot.states.back();
  EXPECT_EQ(last.status, ControllerState::DRIVING) << last.reason;
  const WheelCommand expected = SkidSteerKinematics{GeometryParameters{}}.wheelSpeeds(0.5, 0.4);
  EXPECT_NEAR(last.command_left, expected.left, 0.05);
  EXPECT_NEAR(last.command_right, expected.right, 0.05);
  EXPECT_NEAR(last.belief_forward.at(0), 0.5, 0.01);
  EXPECT_NEAR(last.belief_yaw_rate.at(0), 0.4, 0.01);
  const double span = (last.header.stamp - robot.states.front().header.stamp).toSec();
  EXPECT_GE(span / static_cast<double>(robot.states.size() - 1), 0.019) << "more action steps than periods have passed";
}

}  // namespace
}  // namespace jackal_aic::test
