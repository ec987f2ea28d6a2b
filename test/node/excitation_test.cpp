// The excitation of identify.launch beside another node that publishes commands.

#include <cmath>

#include "controller_process.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

class ExcitationNode : public testing::Test {
 protected:
  void SetUp() override {
    robot.waitFor([] { return !ros::Time::now().isZero(); }, "the clock");
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
