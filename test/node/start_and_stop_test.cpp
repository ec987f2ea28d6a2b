// The controller node as a process: what it refuses to start with, and what it leaves behind when it ends.

#include <diagnostic_msgs/DiagnosticArray.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Bool.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "controller_process.hpp"
#include "relay.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

class StartAndStop : public testing::Test {
 protected:
  /// Loads robot, preset and more files of config/ into the private namespace of a node to come.
  void configure(const std::string& name, const std::string& preset, const std::string& model = "") {
    const std::string config = ros::param::param<std::string>("~config", "");
    for (const std::string& file : {std::string("jackal"), preset, model}) {
      if (file.empty()) continue;
      ASSERT_EQ(std::system(("rosparam load " + config + "/" + file + ".yaml /" + name).c_str()), 0);
    }
  }

  /// Starts a node that has to refuse its parameters; expects exit status 1, one line with all the words, and no
  /// command.
  void expectRefusal(const std::string& name, const std::vector<std::string>& words) {
    SimulatedRobot robot;
    robot.waitFor([] { return !ros::Time::now().isZero(); }, "the clock");
    ControllerProcess process(name);
    ASSERT_TRUE(robot.waitFor([&] { return process.ended(); }, "the node to give up", 60.0));
    EXPECT_EQ(process.exitStatus(), 1);
    const std::string errors = process.errors();
    EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 1) << errors;
    for (const auto& word : words) EXPECT_NE(errors.find(word), std::string::npos) << "'" << word << "' in: " << errors;
    EXPECT_TRUE(robot.drives().empty()) << "a command was published";
  }
};

TEST_F(StartAndStop, RefusesAMissingKey) {
  configure("missing", "standard");
  ros::param::del("/missing/controller/kappa_mu");
  expectRefusal("missing", {"controller.kappa_mu", "missing"});
}

TEST_F(StartAndStop, RefusesGainsThatAreUnstableOnThePlantModel) {
  configure("unstable", "improved", "plant_model");
  ros::param::set("/unstable/controller/kappa_a", 60.0);
  expectRefusal("unstable", {"closed loop", "spectral radius 1.", "kappa_a = 60 is too large: stable below"});
}

TEST_F(StartAndStop, WarnsAboutAThinMargin) {
  configure("thin", "improved", "plant_model");
  ros::param::set("/thin/controller/kappa_a", 25.0);
  SimulatedRobot robot;
  ControllerProcess process("thin");
  ASSERT_TRUE(robot.waitUntilReady());
  EXPECT_NE(process.errors().find("thin margin"), std::string::npos) << process.errors();
}

class EndsBy : public StartAndStop, public testing::WithParamInterface<int> {};

TEST_P(EndsBy, StoppingTheRobot) {
  const std::string name = "ending" + std::to_string(GetParam());
  configure(name, "improved");
  SimulatedRobot robot;
  ControllerProcess process(name);
  ASSERT_TRUE(robot.waitUntilReady());
  robot.command(0.5, 0.0);
  robot.run(2.5);
  ASSERT_NEAR(robot.truth().forward.back(), 0.5, 0.03);
  process.signal(GetParam());
  ASSERT_TRUE(robot.waitFor([&] { return process.ended(); }, "the node to end", 60.0));
  EXPECT_EQ(process.exitStatus(), 0) << process.errors();
  robot.run(1.5);
  ASSERT_FALSE(robot.drives().empty());
  EXPECT_EQ(robot.drives().back().drivers[0], 0.0);
  EXPECT_EQ(robot.drives().back().drivers[1], 0.0);
  EXPECT_NEAR(robot.truth().forward.back(), 0.0, 0.01) << "the plant drives on with its last command";
}

TEST_F(StartAndStop, EndsAfterASlowBrakeAsAfterAnyOther) {
  configure("slow_brake", "improved");
  ros::param::set("/slow_brake/limits/linear_deceleration", 0.5);
  ros::param::set("/slow_brake/brake/linear_deceleration", 0.5);
  ros::param::set("/slow_brake/brake/time", 5.0);
  SimulatedRobot robot;
  ControllerProcess process("slow_brake");
  ASSERT_TRUE(robot.waitUntilReady());
  robot.command(1.5, 0.0);
  robot.run(4.0);
  ASSERT_NEAR(robot.truth().forward.back(), 1.5, 0.05);
  process.signal(SIGINT);
  ASSERT_TRUE(robot.waitFor([&] { return process.ended(); }, "the node to end", 60.0));
  const auto& drives = robot.drives();
  ASSERT_FALSE(drives.empty());
  EXPECT_EQ(drives.back().drivers[0], 0.0);
  for (std::size_t i = drives.size() - 50; i < drives.size(); ++i) {
    EXPECT_GT(drives[i].drivers[0], drives[i - 1].drivers[0] - 0.5) << drives.size() - i << " before the last";
  }
}

INSTANTIATE_TEST_SUITE_P(Signals, EndsBy, testing::Values(SIGINT, SIGTERM));

TEST_F(StartAndStop, AfterAKillItStandsUnderTheSetPointsThatGoOn) {
  configure("killed", "improved");
  SimulatedRobot robot;
  {
    ControllerProcess process("killed");
    ASSERT_TRUE(robot.waitUntilReady());
    robot.rest();
    robot.command(0.5, 0.0);
    robot.run(2.5);
    ASSERT_NEAR(robot.truth().forward.back(), 0.5, 0.03);
  }                // SIGKILL: the plant drives on with the last command
  robot.run(0.2);  // what it had sent before may still be on its way to this process
  robot.clear();
  ControllerProcess process("killed");
  ASSERT_TRUE(robot.waitUntilReady());
  robot.run(3.0);
  ASSERT_FALSE(robot.drives().empty());
  for (const auto& drive : robot.drives()) ASSERT_EQ(drive.drivers[0], 0.0);
  EXPECT_EQ(robot.states().back().status, ControllerState::STOPPED);
  EXPECT_EQ(robot.states().back().reason,
            "set points not zero since the start (waits for a zero set point or a pause)");
  EXPECT_NEAR(robot.truth().forward.back(), 0.0, 0.01);
  robot.stopCommanding();
  robot.run(1.0);
  robot.command(0.5, 0.0);
  robot.run(2.5);
  EXPECT_NEAR(robot.truth().forward.back(), 0.5, 0.03) << robot.states().back().reason;
}

TEST_F(StartAndStop, ALatchedEmergencyStopIsHeardBeforeTheFirstCommand) {
  configure("stopped", "improved");
  ros::NodeHandle node;
  auto stop = node.advertise<std_msgs::Bool>("e_stop", 1, true);
  std_msgs::Bool engaged;
  engaged.data = true;
  stop.publish(engaged);
  SimulatedRobot robot;
  robot.command(0.0, 0.0);
  ControllerProcess process("stopped");
  robot.waitFor([&] { return !robot.drives().empty(); }, "the first command", 60.0);
  robot.command(0.5, 0.0);
  robot.run(2.0);
  for (const auto& drive : robot.drives()) ASSERT_EQ(drive.drivers[0], 0.0);
  EXPECT_EQ(robot.lastState().reason, "emergency stop");
}

TEST_F(StartAndStop, TheNodeWhoseNameWasTakenSaysSoAndStaysDown) {
  configure("twin", "improved");
  SimulatedRobot robot;
  ControllerProcess respawned("twin", "controller_node", {"--respawned"});
  ASSERT_TRUE(robot.waitUntilReady());
  ControllerProcess second("twin");
  const auto told = [](const ControllerProcess& process) {
    return process.errors().find("Another node was started as /twin") != std::string::npos;
  };
  ASSERT_TRUE(robot.waitFor([&] { return told(respawned); }, "the first to say so", 60.0));
  robot.run(3.0);
  EXPECT_FALSE(respawned.ended()) << "roslaunch would start it again, and it would take the name back";
  EXPECT_FALSE(second.ended()) << second.errors();
  robot.clear();
  EXPECT_NE(robot.lastState().reason, "") << "the second one has the robot";
  respawned.signal(SIGTERM);
  EXPECT_TRUE(robot.waitFor([&] { return respawned.ended(); }, "the first to end", 60.0));
  ControllerProcess third("twin");
  EXPECT_TRUE(robot.waitFor([&] { return second.ended(); }, "the second to end", 60.0));
  EXPECT_TRUE(told(second)) << second.errors();
}

TEST_F(StartAndStop, AStallOfTheProcessLeavesNoJump) {
  configure("stalled", "improved");
  SimulatedRobot robot;
  ControllerProcess process("stalled");
  ASSERT_TRUE(robot.waitUntilReady());
  robot.command(0.5, 0.0);
  robot.run(2.5);
  ASSERT_NEAR(robot.truth().forward.back(), 0.5, 0.03);
  robot.clear();
  process.signal(SIGSTOP);
  robot.run(0.3);
  process.signal(SIGCONT);
  robot.run(3.0);
  ASSERT_FALSE(robot.states().empty());
  double fastest = 0.0;
  for (double speed : robot.truth().forward) fastest = std::max(fastest, speed);
  EXPECT_LT(fastest, 0.55);
  for (std::size_t i = 1; i < robot.states().size(); ++i) {
    const auto &a = robot.states()[i - 1], &b = robot.states()[i];
    const double elapsed = (b.header.stamp - a.header.stamp).toSec() + 0.02;
    EXPECT_LE(0.098 * std::abs(b.command_left - a.command_left), 20.0 * elapsed);
  }
  EXPECT_EQ(robot.states().back().status, ControllerState::DRIVING) << robot.states().back().reason;
  EXPECT_NEAR(robot.truth().forward.back(), 0.5, 0.03);
}

/// When the sensors of a robot begin to speak, after the controller has started.
struct Beginning {
  const char* name;
  const char* preset;
  double wheels, imu;  // [s]
};
void PrintTo(const Beginning& beginning, std::ostream* out) { *out << beginning.name; }

class Starts : public StartAndStop, public testing::WithParamInterface<Beginning> {};

TEST_P(Starts, WithoutAWarning) {
  const std::string name = std::string("start_") + GetParam().name;
  configure(name, GetParam().preset, "plant_model");
  SimulatedRobot robot;
  ros::NodeHandle node;
  Relay<sensor_msgs::JointState> wheels(node, "joint_states", name + "/joint_states");
  Relay<sensor_msgs::Imu> imu(node, "imu/data", name + "/imu/data");
  wheels.silence();
  imu.silence();
  ControllerProcess process(name, "controller_node",
                            {"joint_states:=" + name + "/joint_states", "imu/data:=" + name + "/imu/data"});
  ASSERT_TRUE(robot.waitUntilReady());
  const double start = ros::Time::now().toSec();
  const auto runUntil = [&](double time) {
    if (start + time > ros::Time::now().toSec()) robot.run(start + time - ros::Time::now().toSec());
  };
  runUntil(std::min(GetParam().wheels, GetParam().imu));
  if (GetParam().wheels <= GetParam().imu) wheels.alter = nullptr;
  if (GetParam().imu <= GetParam().wheels) imu.alter = nullptr;
  runUntil(std::max(GetParam().wheels, GetParam().imu));
  wheels.alter = nullptr;
  imu.alter = nullptr;
  robot.run(0.5);
  robot.command(1.0, 0.0);
  robot.run(3.0);
  EXPECT_NEAR(robot.truth().forward.back(), 1.0, 0.05);
  for (const auto& state : robot.states()) {
    EXPECT_TRUE(state.status == ControllerState::IDLE || state.status == ControllerState::DRIVING) << state.reason;
    EXPECT_TRUE(state.status == ControllerState::IDLE || state.reason.empty()) << state.reason;
    EXPECT_EQ(state.rejected_measurements, 0u);
  }
  EXPECT_EQ(process.errors().find("WARN"), std::string::npos) << process.errors();
  EXPECT_EQ(process.errors().find("ERROR"), std::string::npos) << process.errors();
}

INSTANTIATE_TEST_SUITE_P(Sensors, Starts,
                         testing::Values(Beginning{"together", "predictive", 0.0, 0.0},
                                         Beginning{"late", "predictive", 3.0, 3.0},
                                         Beginning{"wheels_first", "predictive", 0.3, 0.9},
                                         Beginning{"imu_first", "predictive", 0.9, 0.3},
                                         Beginning{"imu_first_improved", "improved", 0.9, 0.3}),
                         [](const auto& info) { return std::string(info.param.name); });

TEST_F(StartAndStop, SendsZeroWhileNothingWasEverReceived) {
  configure("idle", "improved");
  SimulatedRobot robot;
  ControllerProcess process("idle");
  ASSERT_TRUE(robot.waitUntilReady());
  robot.run(1.0);
  EXPECT_GE(robot.drives().size(), 25u);
  for (const auto& drive : robot.drives()) {
    EXPECT_EQ(drive.drivers[0], 0.0);
    EXPECT_EQ(drive.drivers[1], 0.0);
  }
  EXPECT_EQ(robot.states().back().status, ControllerState::IDLE);
}

TEST_F(StartAndStop, WarnsWhileIdleOfWhatHasNotCome) {
  configure("unheard", "improved");
  std::string told;
  const auto take = [&](const diagnostic_msgs::DiagnosticArrayConstPtr& message) {
    for (const auto& status : message->status) {
      if (status.name.find("unheard") == std::string::npos) continue;
      told = (status.level == diagnostic_msgs::DiagnosticStatus::WARN ? "WARN " : "") + status.message;
    }
  };
  ros::NodeHandle node;
  const auto diagnostics = node.subscribe<diagnostic_msgs::DiagnosticArray>("/diagnostics", 100, take);
  SimulatedRobot robot;
  Relay<sensor_msgs::JointState> wheels(node, "joint_states", "unheard/joint_states");
  Relay<sensor_msgs::Imu> imu(node, "imu/data", "unheard/imu/data");
  wheels.silence();
  imu.silence();
  ControllerProcess process("unheard", "controller_node",
                            {"joint_states:=unheard/joint_states", "imu/data:=unheard/imu/data"});
  ASSERT_TRUE(robot.waitUntilReady());
  const auto expect = [&](const std::string& text) {
    robot.waitFor([&] { return told == text; }, text, 30.0);
    EXPECT_EQ(told, text);
  };
  expect("WARN no set point received yet; no wheel speeds received yet; no IMU data received yet");
  wheels.alter = nullptr;
  imu.alter = nullptr;
  expect("no set point received yet");
}

}  // namespace
}  // namespace jackal_aic::test
