// Output mode gazebo, where nothing but the watchdog stops the wheels when the controller dies or hangs.

#include <std_msgs/Float64.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "controller_process.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

constexpr double kSpeed = 0.5;     // m/s
constexpr double kTimeout = 0.25;  // s, of the watchdog
constexpr double kSlack = 0.5;  // s of simulated time for a busy machine: the simulation does not wait for the watchdog

class WheelWatchdogNode : public testing::Test {
 protected:
  void SetUp() override {
    const std::string config = ros::param::param<std::string>("~config", "");
    for (const char* file : {"jackal", "improved", "plant_model"}) {
      ASSERT_EQ(std::system(("rosparam load " + config + "/" + file + ".yaml /guarded").c_str()), 0);
    }
    ros::param::set("/guarded/output", "gazebo");
  }

  void onWheel(double& last, const std_msgs::Float64& message) {
    last = message.data;
    if (message.data != 0.0) last_motion = ros::Time::now().toSec();
  }

  /// Drives straight on under a controller of its own.
  void drive() {
    ASSERT_TRUE(robot.waitUntilReady());
    robot.command(kSpeed, 0.0);
    robot.run(2.5);
    ASSERT_NEAR(robot.truth().forward.back(), kSpeed, 0.1 * kSpeed);
    for (const auto& state : robot.states())
      ASSERT_EQ(state.reason.find("publishes"), std::string::npos) << state.reason;
  }

  /// Expects both wheels to be told to stand, in time after the last command of the controller, and the robot to.
  void expectStop() {
    robot.waitFor([&] { return left == 0.0 && right == 0.0; }, "zero on the wheels' topics", kTimeout + kSlack);
    EXPECT_LE(ros::Time::now().toSec() - last_motion, kTimeout + kSlack);
    robot.run(1.5);
    EXPECT_EQ(left, 0.0);
    EXPECT_EQ(right, 0.0);
    EXPECT_NEAR(robot.truth().forward.back(), 0.0, 0.01);
  }

  ros::NodeHandle node;
  double left = 0.0, right = 0.0, last_motion = 0.0;
  ros::Subscriber left_wheel = node.subscribe<std_msgs::Float64>(
      "jackal_left_wheel/command", 10, [this](const std_msgs::Float64ConstPtr& m) { onWheel(left, *m); });
  ros::Subscriber right_wheel = node.subscribe<std_msgs::Float64>(
      "jackal_right_wheel/command", 10, [this](const std_msgs::Float64ConstPtr& m) { onWheel(right, *m); });
  SimulatedRobot robot;
};

TEST_F(WheelWatchdogNode, StopsTheWheelsOfAControllerThatHangsAndLetsItGoOn) {
  ControllerProcess controller("guarded");
  drive();
  controller.signal(SIGSTOP);
  expectStop();
  controller.signal(SIGCONT);
  robot.clear();
  robot.run(4.0);
  EXPECT_EQ(robot.states().back().status, ControllerState::DRIVING) << robot.states().back().reason;
  EXPECT_NEAR(robot.truth().forward.back(), kSpeed, 0.1 * kSpeed);
}

TEST_F(WheelWatchdogNode, StopsTheWheelsOfAControllerThatDies) {
  ControllerProcess controller("guarded");
  drive();
  controller.signal(SIGKILL);
  expectStop();
}

}  // namespace
}  // namespace jackal_aic::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "wheel_watchdog_test");
  ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
