// The witness of the commands beside the real controller: it has nothing to say of that one, and accuses another.

#include <diagnostic_msgs/DiagnosticArray.h>
#include <std_msgs/Bool.h>

#include <cstdlib>

#include "controller_process.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

class MonitoredCommands : public testing::Test {
 protected:
  MonitoredCommands() {
    diagnostics_ = node_.subscribe("/diagnostics", 100, &MonitoredCommands::onDiagnostics, this);
    emergency_stop_ = node_.advertise<std_msgs::Bool>("e_stop", 1, true);
  }

  void SetUp() override { ASSERT_TRUE(robot_.waitUntilReady()); }

  void onDiagnostics(const diagnostic_msgs::DiagnosticArray& message) {
    for (const auto& status : message.status) {
      if (status.name.find("Command monitor") != std::string::npos) monitor_ = status;
    }
  }

  void stop(bool engaged) {
    std_msgs::Bool message;
    message.data = engaged;
    emergency_stop_.publish(message);
  }

  /// What the monitor has counted under a name.
  double count(const std::string& name) const {
    for (const auto& value : monitor_.values) {
      if (value.key == name) return std::stod(value.value);
    }
    return -1.0;
  }

  ros::NodeHandle node_;
  ros::Subscriber diagnostics_;
  ros::Publisher emergency_stop_;
  diagnostic_msgs::DiagnosticStatus monitor_;
  SimulatedRobot robot_;
};

TEST_F(MonitoredCommands, TheControllerIsNotAccusedAndAnotherIs) {
  robot_.command(0.8, 0.5);
  robot_.run(3.0);
  stop(true);
  robot_.run(2.0);
  stop(false);
  robot_.command(0.0, 0.0);
  robot_.run(0.5);
  robot_.command(-0.5, 0.0);
  robot_.run(2.0);
  robot_.stopCommanding();  // the set point grows old
  robot_.run(3.0);
  robot_.command(0.0, 0.0);
  robot_.run(7.0);
  ASSERT_TRUE(robot_.waitFor([this] { return count("Commands") > 700.0; }, "commands in the monitor's diagnostics"));
  EXPECT_EQ(monitor_.level, diagnostic_msgs::DiagnosticStatus::OK) << monitor_.message;
  EXPECT_EQ(monitor_.message, "no requirement broken");

  ros::Publisher other = node_.advertise<jackal_msgs::Drive>("cmd_drive", 1);
  ASSERT_TRUE(robot_.waitFor([&] { return other.getNumSubscribers() >= 3; }, "plant, monitor and this test's own"));
  jackal_msgs::Drive wild;
  wild.mode = jackal_msgs::Drive::MODE_VELOCITY;
  wild.drivers = {40.0F, 40.0F};
  other.publish(wild);
  EXPECT_TRUE(robot_.waitFor([this] { return count("LIM-1") >= 1.0; }, "an accusation"));
  EXPECT_EQ(monitor_.level, diagnostic_msgs::DiagnosticStatus::ERROR);
  EXPECT_NE(monitor_.message.find("LIM-1 broken"), std::string::npos) << monitor_.message;
}

TEST_F(MonitoredCommands, AControllerThatCommandsByAnotherTopicIsNotWatched) {
  const std::string config = ros::param::param<std::string>("~config", "");
  for (const char* part : {"jackal", "improved"}) {
    ASSERT_EQ(std::system(("rosparam load " + config + "/" + part + ".yaml /elsewhere").c_str()), 0);
  }
  ros::param::set("/elsewhere/output", "twist");
  ControllerProcess monitor("elsewhere_monitor", "command_monitor", {"_controller:=/elsewhere"});
  ASSERT_TRUE(robot_.waitFor([&] { return monitor.ended(); }, "the monitor to end", 60.0));
  EXPECT_EQ(monitor.exitStatus(), 0);
  EXPECT_NE(monitor.errors().find("Nothing to watch: /elsewhere does not publish cmd_drive"), std::string::npos)
      << monitor.errors();
}

}  // namespace
}  // namespace jackal_aic::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "monitored_commands_test");
  return RUN_ALL_TESTS();
}
