// Two robots in one graph keep apart: topics, frames, parameters.

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <sensor_msgs/Imu.h>
#include <tf2_msgs/TFMessage.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include "../repository.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

/// The view that show_rviz has rviz show; a stand-in prints it.
std::string viewOf(const std::string& options) {
  const std::filesystem::path directory = testing::TempDir() + "show_rviz" + std::to_string(getpid());
  std::filesystem::create_directories(directory);
  std::ofstream(directory / "rviz") << "#!/bin/sh\n[ \"$1\" = -d ] && cat \"$2\"\n";
  std::filesystem::permissions(directory / "rviz", std::filesystem::perms::owner_all);
  const std::string command = "PATH=" + directory.string() + ":$PATH ROS_HOME=" + directory.string() + " " +
                              (kRoot / "launch/show_rviz").string() + " " + options + " >" + directory.string() +
                              "/out";
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  const std::string view = textOf(directory / "out");
  std::filesystem::remove_all(directory);
  return view;
}

/// Every topic of a view is published in the namespace of its robot.
void expectPublished(const std::string& view, const std::string& robot) {
  const std::set<std::string> shown = found(view, "Topic: \"?([^\"\\s]+)");
  EXPECT_EQ(shown.size(), 6u) << view;
  ros::master::V_TopicInfo published;
  ASSERT_TRUE(ros::master::getTopics(published));
  for (const std::string& topic : shown) {
    const std::string name = ros::names::append("/" + robot, topic);
    EXPECT_TRUE(std::any_of(published.begin(), published.end(), [&](const auto& info) { return info.name == name; }))
        << name;
  }
}

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
    // Zero first releases the latch of the start.
    const bool drive =
        first.state.status == ControllerState::DRIVING && second.state.status == ControllerState::DRIVING;
    first.set_point.publish(drive ? forward : geometry_msgs::Twist());
    second.set_point.publish(drive ? turn : geometry_msgs::Twist());
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

  // In all of space rviz draws no ellipse but a column: nothing is known of the height.
  const auto pose = ros::topic::waitForMessage<geometry_msgs::PoseWithCovarianceStamped>(
      "/robot1/jackal_AIC/arrows/pose", ros::Duration(20.0));
  ASSERT_TRUE(pose);
  const auto& covariance = pose->pose.covariance;
  EXPECT_GT(std::min({covariance[0], covariance[7], covariance[35]}), 0.0);
  for (int row : {2, 3, 4}) EXPECT_EQ(covariance[row * 7], 0.0) << row;

  const std::string view = viewOf("--tf-prefix=robot1 __name:=rviz");
  expectPublished(view, "robot1");
  const std::set<std::string> shown = found(view, "(?:Fixed|Target) Frame: \"?([^\"\\s]+)");
  EXPECT_EQ(shown.size(), 2u) << view;
  for (const std::string& frame : shown) EXPECT_EQ(frames.count(frame), 1u) << frame;
  EXPECT_EQ(found(view, "TF Prefix: \"?([^\"\\s]*)"), std::set<std::string>{"robot1"});
}

TEST(TwoRobots, AViewWithoutAPrefixHasTheFramesOfARobotAlone) {
  const std::string view = viewOf("--tf-prefix=");
  EXPECT_EQ(found(view, "(?:Fixed|Target) Frame: \"?([^\"\\s]+)"), (std::set<std::string>{"odom", "base_link"}));
  EXPECT_EQ(view.find('@'), std::string::npos) << view;
}

}  // namespace
}  // namespace jackal_aic::test
