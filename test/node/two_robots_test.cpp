// Two robots in one graph keep apart: topics, frames, parameters.

#include <sensor_msgs/Imu.h>
#include <tf2_msgs/TFMessage.h>

#include <set>

#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

/// The last true velocity and state of one of them.
struct Robot {
  explicit Robot(const std::string& name) {
    set_point = node.advertise<geometry_msgs::Twist>("/" + name + "/jackal_AIC/set_point", 1);
    subscribers.push_back(node.subscribe<nav_msgs::Odometry>(
        "/" + name + "/ground_truth/odom", 100, [this](const nav_msgs::OdometryConstPtr& m) { truth = *m; }));
    subscribers.push_back(node.subscribe<nav_msgs::Odometry>(
        "/" + name + "/odom", 100, [this](const nav_msgs::OdometryConstPtr& m) { odometry = *m; }));
    subscribers.push_back(node.subscribe<ControllerState>("/" + name + "/jackal_AIC/state", 100,
                                                          [this](const ControllerStateConstPtr& m) { state = *m; }));
    subscribers.push_back(node.subscribe<sensor_msgs::Imu>("/" + name + "/imu/data", 100,
                                                           [this](const sensor_msgs::ImuConstPtr& m) { imu = *m; }));
  }

  ros::NodeHandle node;
  ros::Publisher set_point;
  std::vector<ros::Subscriber> subscribers;
  nav_msgs::Odometry truth, odometry;
  ControllerState state;
  sensor_msgs::Imu imu;
};

TEST(TwoRobots, DriveApartOnOneClock) {
  Robot first("robot1"), second("robot2");
  std::set<std::string> frames;
  ros::NodeHandle node;
  const auto take = [&](const tf2_msgs::TFMessageConstPtr& message) {
    for (const auto& transform : message->transforms)
      frames.insert({transform.header.frame_id, transform.child_frame_id});
  };
  const ros::Subscriber moving = node.subscribe<tf2_msgs::TFMessage>("/tf", 100, take);
  const ros::Subscriber fixed = node.subscribe<tf2_msgs::TFMessage>("/tf_static", 100, take);
  geometry_msgs::Twist forward, turn;
  forward.linear.x = 0.4;
  turn.angular.z = 0.5;

  const auto reached = [&] {
    return std::abs(first.truth.twist.twist.linear.x - 0.4) < 0.05 &&
           std::abs(second.truth.twist.twist.angular.z - 0.5) < 0.08;
  };
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(60.0);
  while (ros::ok() && !reached() && ros::WallTime::now() < end) {
    first.set_point.publish(forward);
    second.set_point.publish(turn);
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.02));
    ros::WallDuration(0.03).sleep();
  }
  ASSERT_TRUE(reached()) << first.state.reason << " / " << second.state.reason;
  EXPECT_NEAR(first.truth.twist.twist.angular.z, 0.0, 0.1);
  EXPECT_NEAR(second.truth.twist.twist.linear.x, 0.0, 0.1);
  EXPECT_EQ(first.state.reason, "");
  EXPECT_EQ(second.state.reason, "");
  EXPECT_NEAR((first.truth.header.stamp - second.truth.header.stamp).toSec(), 0.0, 0.2);

  EXPECT_EQ(first.odometry.header.frame_id, "robot1/odom");
  EXPECT_EQ(first.odometry.child_frame_id, "robot1/base_link");
  EXPECT_EQ(second.odometry.header.frame_id, "robot2/odom");
  EXPECT_EQ(second.imu.header.frame_id, "robot2/imu_link");
  EXPECT_EQ(second.state.header.frame_id, "robot2/base_link");
  for (const std::string& frame : frames) {
    EXPECT_TRUE(frame.rfind("robot1/", 0) == 0 || frame.rfind("robot2/", 0) == 0) << frame;
  }
  EXPECT_GT(frames.size(), 4u);
}

}  // namespace
}  // namespace jackal_aic::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "two_robots_test");
  ros::NodeHandle node;
  return RUN_ALL_TESTS();
}
