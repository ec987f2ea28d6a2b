// The excitation of identify.launch with another publisher of commands, and with its recorder.

#include <std_msgs/Bool.h>
#include <std_srvs/Trigger.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

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
  EXPECT_FALSE(driven()) << "not confirmed yet";
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

/// For a robot without cmd_drive, or with a bringup that has it for itself.
TEST_F(ExcitationNode, DrivesByBodyVelocities) {
  ros::param::set("/twister/session/countdown", 0.0);
  ros::param::set("/twister/session/twist", true);
  double fastest = 0.0;
  const auto commands = node.subscribe<geometry_msgs::Twist>(
      "cmd_vel", 10,
      [&fastest](const geometry_msgs::TwistConstPtr& twist) { fastest = std::max(fastest, twist->linear.x); });
  ControllerProcess process("twister", "excitation_node");
  ASSERT_TRUE(robot.waitFor([&] { return fastest > 0.59; }, "the full speed", 30.0));
  EXPECT_FALSE(driven());
  geometry_msgs::Twist abort;
  robot.publishOnce(abort);
  ASSERT_TRUE(robot.waitFor([&] { return process.ended(); }, "the excitation to end", 60.0));
}

TEST_F(ExcitationNode, EndsWhenAnotherPublisherAppears) {
  ControllerProcess process("exciter", "excitation_node");
  ASSERT_TRUE(robot.waitFor([&] { return driven(); }, "the excitation to begin", 30.0));
  const auto intruder = node.advertise<jackal_msgs::Drive>("cmd_drive", 10);
  expectEnd(process);
}

/// A directory of its own for the bag, and a recorder as that of identify.launch.
class RecordedExcitation : public ExcitationNode {
 protected:
  void SetUp() override {
    ExcitationNode::SetUp();
    std::filesystem::create_directories(directory);
  }
  void TearDown() override { std::filesystem::remove_all(directory); }

  /// Tells an excitation which bag is recorded.
  static void setSession(const std::string& name, const std::string& bag) {
    ros::param::set("/" + name + "/session/countdown", 0.0);
    ros::param::set("/" + name + "/session/bag", bag);
  }

  /// Starts the recorder of an excitation.
  static ControllerProcess recorder(const std::string& name, const std::string& bag) {
    return ControllerProcess("record_of_" + name, "record", {bag, "--only", "cmd_drive"});
  }

  static std::string content(const std::string& path) {
    std::ifstream file(path);
    std::string line;
    std::getline(file, line);
    return line;
  }

  const std::string directory = "/tmp/recorded_excitation_" + std::to_string(getpid());
  const std::string bag = directory + "/drive.bag";
};

TEST_F(RecordedExcitation, DoesNotDriveWhenTheBagCannotBeWritten) {
  setSession("unwritten", directory + "/none/drive.bag");
  ControllerProcess process("unwritten", "excitation_node");
  const ControllerProcess record = recorder("unwritten", directory + "/none/drive.bag");
  ASSERT_TRUE(robot.waitFor([&] { return process.ended(); }, "the excitation to give up", 60.0));
  EXPECT_EQ(process.exitStatus(), 1);
  EXPECT_NE(process.errors().find("the recorder does not write " + directory + "/none/drive.bag"), std::string::npos)
      << process.errors();
  EXPECT_FALSE(driven());
}

TEST_F(RecordedExcitation, StopsWhenTheRecorderEndsAndKeepsTheEarlierBag) {
  std::ofstream(bag) << "an earlier drive";
  std::ofstream(bag + ".1") << "the first drive";
  setSession("abandoned", bag);
  ControllerProcess process("abandoned", "excitation_node");
  const ControllerProcess record = recorder("abandoned", bag);
  ASSERT_TRUE(robot.waitFor([&] { return driven(); }, "the excitation to begin", 60.0));
  EXPECT_EQ(std::system("rosnode kill /record_of_abandoned > /dev/null"), 0);
  ASSERT_TRUE(robot.waitFor([&] { return process.ended(); }, "the excitation to give up", 60.0));
  EXPECT_EQ(process.exitStatus(), 1);
  EXPECT_NE(process.errors().find("was not driven to its end: the recorder has ended, which was to write " + bag),
            std::string::npos)
      << process.errors();
  // rosnode kill may take longer than the brake: what came meanwhile still waits to be received.
  robot.waitFor([&] { return driven() && robot.drives().back().drivers[0] == 0.0F; }, "the last command", 10.0);
  ASSERT_FALSE(robot.drives().empty());
  EXPECT_EQ(robot.drives().back().drivers[0], 0.0F);
  EXPECT_EQ(content(bag), "#ROSBAG V2.0");
  EXPECT_EQ(content(bag + ".1"), "the first drive");
  EXPECT_EQ(content(bag + ".2"), "an earlier drive");
}

}  // namespace
}  // namespace jackal_aic::test
