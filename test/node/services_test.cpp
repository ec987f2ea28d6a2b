// The services that hold the controller at rest and reset it.

#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include "service_call.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

class Services : public testing::Test {
 protected:
  Services() { odometry_subscriber_ = node_.subscribe("odom", 100, &Services::onOdometry, this); }

  void SetUp() override {
    ASSERT_TRUE(robot.waitUntilReady());
    enable(true);
    robot.rest();
  }

  static void enable(bool enabled) {
    std_srvs::SetBool call;
    call.request.data = enabled;
    ASSERT_TRUE(sim::callService("/controller/enable", call, ros::Duration(30.0)));
    EXPECT_TRUE(call.response.success) << call.response.message;
  }

  static std_srvs::Trigger::Response trigger(const std::string& name) {
    std_srvs::Trigger call;
    EXPECT_TRUE(sim::callService("/controller/" + name, call, ros::Duration(30.0)));
    return call.response;
  }

  void onOdometry(const nav_msgs::Odometry& message) { odometry = message; }
  void expectSpeed(double speed) const { EXPECT_NEAR(robot.truth().forward.back(), speed, 0.02); }

  ros::NodeHandle node_;
  SimulatedRobot robot;
  nav_msgs::Odometry odometry;
  ros::Subscriber odometry_subscriber_;
};

TEST_F(Services, DisabledItBrakesAndStandsUntilItIsEnabledAndToldToAnew) {
  robot.command(0.5, 0.0);
  robot.run(2.0);
  expectSpeed(0.5);
  enable(false);
  robot.run(1.0);
  expectSpeed(0.0);
  EXPECT_EQ(robot.states().back().status, ControllerState::STOPPED);
  EXPECT_EQ(robot.states().back().reason, "disabled");
  EXPECT_EQ(robot.states().back().command_left, 0.0);
  enable(true);
  robot.run(1.0);
  expectSpeed(0.0);
  EXPECT_NE(robot.states().back().reason.find("zero set point"), std::string::npos) << robot.states().back().reason;
  robot.command(0.0, 0.0);
  robot.run(0.5);
  robot.command(0.5, 0.0);
  robot.run(2.0);
  expectSpeed(0.5);
}

TEST_F(Services, ResetIsRefusedOnTheMoveAndDoesNotSetOff) {
  robot.command(0.5, 0.0);
  robot.run(2.0);
  EXPECT_FALSE(trigger("reset").success);
  robot.run(0.5);
  expectSpeed(0.5);
  enable(false);
  robot.run(1.0);
  const auto done = trigger("reset");
  EXPECT_TRUE(done.success) << done.message;
  enable(true);
  robot.run(1.0);
  expectSpeed(0.0);
  EXPECT_NE(robot.states().back().reason.find("zero set point"), std::string::npos) << robot.states().back().reason;
}

TEST_F(Services, ResetForgetsTheMotionAndNotTheWay) {
  robot.command(0.5, 0.0);
  robot.run(2.0);
  robot.command(0.0, 0.0);
  robot.run(1.0);
  const double before = odometry.pose.pose.position.x;
  EXPECT_GT(before, 0.5);
  const auto done = trigger("reset");
  EXPECT_TRUE(done.success) << done.message;
  robot.run(0.2);
  EXPECT_NEAR(odometry.pose.pose.position.x, before, 0.01) << "an odometry frame does not jump";
  robot.command(0.4, 0.0);
  robot.run(2.0);
  expectSpeed(0.4);
}

TEST_F(Services, WithoutAFileThereIsNothingToSaveTo) {
  const auto answer = trigger("save_learned_model");
  EXPECT_FALSE(answer.success);
  EXPECT_NE(answer.message.find("slip.file is not set"), std::string::npos) << answer.message;
}

}  // namespace
}  // namespace jackal_aic::test
