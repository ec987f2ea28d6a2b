// The excitation of identify.launch beside another node that publishes commands.

#include <std_msgs/Bool.h>
#include <std_srvs/Trigger.h>

#include <algorithm>
#include <cmath>

#include "controller_process.hpp"
#include "service_call.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

class ExcitationNode : public testing::Test {
 protected:
  void SetUp() override {
    robot.waitFor([] { return !ros::Time::now().isZero(); }, "the clock");
    ros::param::set("/exciter/session/countdown", 0.0);
  }

  bool driven() const {
    return std::any_of(robot.drives().begin(), robot.drives().end(),
                       [](const jackal_msgs::Drive& drive) { return drive.drivers[0] != 0.0F; });
  }

  void expectEnd(ControllerProcess& process) {
    ASSERT_TRUE(robot.waitFor([&] { return process.ended(); }, "the excitation to give up", 60.0));
    EXPECT_EQ(process.exitStatus(), 1);
    const std::string expected = "another node publishes commands: " + ros::this_node::getName() + " on /cmd_drive";
    EXPECT_NE(process.errors().find(expected), std::string::npos) << process.errors();
  }

  ros::NodeHandle node;
  SimulatedRobot robot;
};

TEST_F(ExcitationNode, RefusesToDriveBesideAnotherPublisher) {
  const auto intruder = node.advertise<jackal_msgs::Drive>("cmd_drive", 10);
  ControllerProcess process("exciter", "excitation_node");
  expectEnd(process);
  EXPECT_FALSE(driven());
}

TEST_F(ExcitationNode, EndsWithAnEmergencyStopAndBrakes) {
  auto e_stop = node.advertise<std_msgs::Bool>("e_stop", 1, true);
  ControllerProcess process("exciter", "excitation_node");
  ASSERT_TRUE(robot.waitFor([&] { return driven(); }, "the excitation to begin", 30.0));
  std_msgs::Bool pressed;
  pressed.data = true;
  e_stop.publish(pressed);
  ASSERT_TRUE(robot.waitFor([&] { return process.ended(); }, "the excitation to give up", 60.0));
  EXPECT_EQ(process.exitStatus(), 1);
  EXPECT_NE(process.errors().find("was not driven to its end: emergency stop"), std::string::npos) << process.errors();
  ASSERT_FALSE(robot.drives().empty());
  EXPECT_EQ(robot.drives().back().drivers[0], 0.0F);
}

TEST_F(ExcitationNode, RefusesToStartUnderAnEmergencyStop) {
  auto e_stop = node.advertise<std_msgs::Bool>("e_stop", 1, true);
  std_msgs::Bool pressed;
  pressed.data = true;
  e_stop.publish(pressed);
  ControllerProcess process("exciter", "excitation_node");
  ASSERT_TRUE(robot.waitFor([&] { return process.ended(); }, "the excitation to give up", 60.0));
  EXPECT_EQ(process.exitStatus(), 1);
  EXPECT_NE(process.errors().find("emergency stop"), std::string::npos) << process.errors();
  EXPECT_FALSE(driven());
}

TEST_F(ExcitationNode, WaitsForConfirmationAndKeepsItsAcceleration) {
  ros::param::set("/confirmed/session/confirm", true);
  ros::param::set("/confirmed/session/countdown", 0.5);
  ControllerProcess process("confirmed", "excitation_node");
  ASSERT_TRUE(ros::service::waitForService("/confirmed/start", ros::Duration(60.0)));
  robot.run(5.0);
  EXPECT_FALSE(driven()) << "nobody has confirmed";
  std_srvs::Trigger start;
  ASSERT_TRUE(sim::callService("/confirmed/start", start));
  ASSERT_TRUE(robot.waitFor([&] { return driven(); }, "the excitation to begin", 30.0));
  ASSERT_TRUE(robot.waitFor([&] { return process.ended(); }, "the excitation to end", 60.0));
  EXPECT_EQ(process.exitStatus(), 0) << process.errors();
  double largest = 0.0, before = 0.0;
  for (const jackal_msgs::Drive& drive : robot.drives()) {
    largest = std::max(largest, std::abs(drive.drivers[0] - before));
    before = drive.drivers[0];
  }
  constexpr double kStep = 0.02 * 20.0 / 0.098;  // by 20 m/s^2 in a period
  EXPECT_GT(largest, 0.5 * kStep);
  EXPECT_LE(largest, 1.01 * kStep);
  EXPECT_EQ(before, 0.0);
}

TEST_F(ExcitationNode, EndsWhenAnotherPublisherAppears) {
  ControllerProcess process("exciter", "excitation_node");
  ASSERT_TRUE(robot.waitFor([&] { return driven(); }, "the excitation to begin", 30.0));
  const auto intruder = node.advertise<jackal_msgs::Drive>("cmd_drive", 10);
  expectEnd(process);
}

}  // namespace
}  // namespace jackal_aic::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "excitation_test");
  ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
