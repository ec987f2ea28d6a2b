// Output mode gazebo: the same robot driven through Gazebo's wheel topics.

#include <std_msgs/Float64.h>

#include <cstdlib>

#include "controller_process.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

TEST(GazeboOutput, DrivesThroughTheWheelTopicsAndNotThroughCmdDrive) {
  ros::NodeHandle node;
  double left = 0.0, right = 0.0;
  const auto left_wheel = node.subscribe<std_msgs::Float64>(
      "jackal_left_wheel/command", 10, [&](const std_msgs::Float64ConstPtr& m) { left = m->data; });
  const auto right_wheel = node.subscribe<std_msgs::Float64>(
      "jackal_right_wheel/command", 10, [&](const std_msgs::Float64ConstPtr& m) { right = m->data; });
  SimulatedRobot robot;
  ASSERT_TRUE(robot.waitUntilReady());
  robot.rest();
  const double start = robot.command(0.5, 0.0);
  robot.run(4.0);
  EXPECT_NEAR(robot.forwardStep(start, 0.5).steady_error_pct, 0.0, 1.0);
  EXPECT_NEAR(left, 0.5 / 0.098, 0.5);
  EXPECT_NEAR(right, 0.5 / 0.098, 0.5);

  robot.rest();
  robot.command(0.0, 0.5);
  robot.run(3.0);
  EXPECT_LT(left, -1.0);
  EXPECT_GT(right, 1.0);
  EXPECT_GT(robot.truth().yaw_rate.back(), 0.4);
  EXPECT_TRUE(robot.drives().empty()) << "published on cmd_drive in output mode gazebo";
}

/// Nothing would stop the wheels of a robot if the node dies.
TEST(GazeboOutput, EndsOnARobotThatPublishesFeedback) {
  const std::string config = ros::param::param<std::string>("~config", "");
  for (const char* file : {"jackal", "improved"}) {
    ASSERT_EQ(std::system(("rosparam load " + config + "/" + file + ".yaml /on_robot").c_str()), 0);
  }
  ros::param::set("/on_robot/output", "gazebo");
  SimulatedRobot robot;
  ControllerProcess process("on_robot", "controller_node",
                            {"jackal_left_wheel/command:=l", "jackal_right_wheel/command:=r"});
  ASSERT_TRUE(robot.waitFor([&] { return process.ended(); }, "the node to end", 60.0));
  EXPECT_EQ(process.exitStatus(), 1);
  EXPECT_NE(process.errors().find("output = gazebo: for simulations only"), std::string::npos) << process.errors();
}

}  // namespace
}  // namespace jackal_aic::test
