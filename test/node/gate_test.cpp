// What the controller node does when the robot, its user or another node stands in the way.

#include <diagnostic_msgs/DiagnosticArray.h>
#include <jackal_msgs/Feedback.h>
#include <jackal_msgs/Status.h>
#include <ros/master.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Bool.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "relay.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

constexpr double kSpeed = 0.5;              // m/s
constexpr double kRadius = 0.098;           // m
constexpr double kEffectiveTrack = 0.5621;  // m
constexpr double kLate = 5 * kActionPeriod;

class DriveGateNode : public testing::Test {
 protected:
  void SetUp() override {
    e_stop = node.advertise<std_msgs::Bool>("e_stop", 10);
    status = node.advertise<jackal_msgs::Status>("status", 10);
    ASSERT_TRUE(robot.waitUntilReady());
    const auto listens = [this] {
      return e_stop.getNumSubscribers() > 0 && status.getNumSubscribers() > 0 && wheels.heard() && imu.heard() &&
             feedback.heard();
    };
    ASSERT_TRUE(robot.waitFor(listens, "the controller to listen"));
    robot.rest();
    robot.command(kSpeed, 0.0);
    robot.run(2.5);
    ASSERT_NEAR(robot.truth().forward.back(), kSpeed, 0.05 * kSpeed);
    robot.clear();
    onset = ros::Time::now().toSec();
  }

  void TearDown() override {
    wheels.alter = nullptr;
    imu.alter = nullptr;
    feedback.alter = nullptr;
    press(false);
    robot.run(0.2);
    robot.rest();
    robot.stopCommanding();
  }

  void press(bool stop) {
    std_msgs::Bool message;
    message.data = stop;
    e_stop.publish(message);
  }

  void reportStop(bool stopped) {
    jackal_msgs::Status message;
    message.drivers_active = true;
    message.driver_external_stop_present = true;
    message.driver_external_stop_stopped = stopped;
    status.publish(message);
  }

  static bool still(const ControllerState& state) { return state.command_left == 0.0 && state.command_right == 0.0; }

  /// Expects the command to fall from the onset on, at most `latency` late, to zero within `duration`, without a step
  /// beyond a deceleration [m/s^2], and the robot to stand in `status` for a reason afterwards.
  void expectBrake(double latency, double duration, double deceleration, std::uint8_t status_at_rest,
                   const std::string& word) {
    robot.run(2.0);
    const ControllerState* brake =
        robot.firstState(onset, [](const ControllerState& s) { return s.status == ControllerState::BRAKING; });
    ASSERT_NE(brake, nullptr) << "drove on";
    EXPECT_LE(brake->header.stamp.toSec(), onset + latency + kLate);
    EXPECT_NE(brake->reason.find(word), std::string::npos) << brake->reason;
    const ControllerState* rest = robot.firstState(brake->header.stamp.toSec() - 1e-6, still);
    ASSERT_NE(rest, nullptr);
    EXPECT_LE((rest->header.stamp - brake->header.stamp).toSec(), duration + 2 * kActionPeriod);
    EXPECT_LE(robot.largestCommandStep(), (deceleration + 0.1) * kActionPeriod / kRadius);
    const ControllerState& last = robot.states().back();
    EXPECT_EQ(last.status, status_at_rest) << last.reason;
    EXPECT_NE(last.reason.find(word), std::string::npos) << last.reason;
    EXPECT_TRUE(still(last));
    EXPECT_NEAR(robot.truth().forward.back(), 0.0, 0.01);
    robot.clear();
  }

  /// Expects the robot to take up its speed again without a jump.
  void expectRecovery() {
    robot.run(3.0);
    EXPECT_EQ(robot.states().back().status, ControllerState::DRIVING) << robot.states().back().reason;
    EXPECT_NEAR(robot.truth().forward.back(), kSpeed, 0.05 * kSpeed);
    EXPECT_LT(robot.largestCommandStep(), 1.0) << "recovery must be free of jumps";
  }

  /// Expects that the end of a stop does not set the robot off under the set point that goes on, and that a zero set
  /// point does.
  void expectAcknowledgedRecovery() {
    robot.run(2.0);
    ASSERT_FALSE(robot.states().empty());
    for (const auto& state : robot.states()) ASSERT_TRUE(still(state)) << "set off by the release alone";
    EXPECT_NE(robot.states().back().reason.find("zero set point"), std::string::npos) << robot.states().back().reason;
    robot.command(0.0, 0.0);
    robot.run(0.2);
    robot.clear();
    robot.command(kSpeed, 0.0);
    expectRecovery();
  }

  ros::NodeHandle node;
  SimulatedRobot robot;
  Relay<sensor_msgs::JointState> wheels{node, "joint_states", "relayed/joint_states"};
  Relay<sensor_msgs::Imu> imu{node, "imu/data", "relayed/imu"};
  Relay<jackal_msgs::Feedback> feedback{node, "feedback", "relayed/feedback"};
  ros::Publisher e_stop, status;
  double onset = 0.0;
};

TEST_F(DriveGateNode, AnEmergencyStopHoldsUntilItIsReleased) {
  press(true);
  expectBrake(0.0, 0.06, 20.0, ControllerState::STOPPED, "emergency stop");
  robot.run(2.0);
  ASSERT_FALSE(robot.states().empty());
  for (const auto& state : robot.states()) EXPECT_TRUE(still(state));
  press(false);
  expectAcknowledgedRecovery();
}

TEST_F(DriveGateNode, AfterAnEmergencyStopASetPointThatPausedIsAFreshOne) {
  press(true);
  robot.run(1.0);
  press(false);
  robot.run(0.5);
  EXPECT_EQ(robot.states().back().status, ControllerState::STOPPED);
  robot.stopCommanding();
  robot.run(0.8);
  robot.clear();
  robot.command(kSpeed, 0.0);
  expectRecovery();
}

TEST_F(DriveGateNode, ARobotThatIsStoppedHoldsTheAction) {
  reportStop(true);
  expectBrake(0.0, 0.06, 20.0, ControllerState::STOPPED, "robot reports that it is stopped");
  reportStop(false);
  expectAcknowledgedRecovery();
}

TEST_F(DriveGateNode, MotorsWithoutVelocityControlStop) {
  feedback.alter = [](jackal_msgs::Feedback& message) {
    message.actual_mode = jackal_msgs::Drive::MODE_NONE;
    return true;
  };
  expectBrake(0.02, 0.06, 20.0, ControllerState::STOPPED, "velocity commands");
  feedback.alter = nullptr;
  expectAcknowledgedRecovery();
}

TEST_F(DriveGateNode, ADriverFaultHasToBeAcknowledged) {
  feedback.alter = [](jackal_msgs::Feedback& message) {
    message.drivers[1].driver_fault = true;
    return true;
  };
  expectBrake(0.02, 0.06, 20.0, ControllerState::FAULTED, "motor driver");
  feedback.alter = nullptr;
  robot.run(3.0);
  EXPECT_EQ(robot.states().back().status, ControllerState::FAULTED) << "set off again by itself";
  EXPECT_NE(robot.states().back().reason.find("zero set point"), std::string::npos) << robot.states().back().reason;
  robot.command(0.0, 0.0);
  robot.run(0.3);
  robot.clear();
  robot.command(kSpeed, 0.0);
  expectRecovery();
}

TEST_F(DriveGateNode, SilentFeedbackStopsAlthoughJointStatesGoOn) {
  feedback.alter = [](jackal_msgs::Feedback&) { return false; };
  expectBrake(0.2, 0.18, 3.0, ControllerState::STOPPED, "feedback");
  feedback.alter = nullptr;
  expectRecovery();
}

TEST_F(DriveGateNode, FrozenWheelSpeedsWithFreshStampsStop) {
  wheels.freeze();
  expectBrake(0.3 + 0.04, 0.18, 3.0, ControllerState::STOPPED, "wheel speeds frozen");
  wheels.alter = nullptr;
  expectRecovery();
}

TEST_F(DriveGateNode, DrivesOnTheWheelsWhileTheImuIsSilentOrFrozenOrOfThePast) {
  const auto silent = [](sensor_msgs::Imu&) { return false; };
  const auto stale = [](sensor_msgs::Imu& message) {
    message.header.stamp -= ros::Duration(1.0);
    return true;
  };
  for (int i = 0; i < 3; ++i) {
    robot.command(kSpeed, 0.4);
    robot.run(2.0);
    robot.clear();
    if (i == 2) {
      imu.freeze();
    } else {
      imu.alter = i == 0 ? std::function<bool(sensor_msgs::Imu&)>(silent) : stale;
    }
    robot.run(2.0);
    EXPECT_EQ(robot.states().back().status, ControllerState::DRIVING) << robot.states().back().reason;
    EXPECT_FALSE(robot.states().back().reason.empty()) << "case " << i << ": the loss must be told";
    EXPECT_NEAR(robot.truth().forward.back(), kSpeed, 0.05 * kSpeed);
    EXPECT_NEAR(robot.truth().yaw_rate.back(), 0.4, 0.1 * 0.4);
    EXPECT_LT(robot.largestCommandStep(), 1.0);
    imu.alter = nullptr;
    robot.run(2.0);
    EXPECT_TRUE(robot.states().back().reason.empty()) << robot.states().back().reason;
    EXPECT_LT(robot.largestCommandStep(), 1.0) << "the IMU is taken again without a jump";
  }
}

TEST_F(DriveGateNode, StampsFromTheFutureStop) {
  wheels.alter = [](sensor_msgs::JointState& message) {
    message.header.stamp += ros::Duration(10.0);
    return true;
  };
  expectBrake(0.2, 0.18, 3.0, ControllerState::STOPPED, "wheel speeds too old");
}

TEST_F(DriveGateNode, StampsFromThePastStop) {
  wheels.alter = [](sensor_msgs::JointState& message) {
    message.header.stamp -= ros::Duration(1.0);
    return true;
  };
  expectBrake(0.02, 0.18, 3.0, ControllerState::STOPPED, "wheel speeds too old");
  wheels.alter = nullptr;
  expectRecovery();
}

TEST_F(DriveGateNode, MessagesWithoutAStampAreNoMeasurements) {
  const auto rejected = robot.states().empty() ? 0u : robot.states().back().rejected_measurements;
  wheels.alter = [](sensor_msgs::JointState& message) {
    message.header.stamp = ros::Time();
    return true;
  };
  expectBrake(0.2, 0.18, 3.0, ControllerState::STOPPED, "wheel speeds too old");
  robot.run(0.1);
  EXPECT_GT(robot.lastState().rejected_measurements, rejected + 50);
  wheels.alter = nullptr;
  expectRecovery();
}

TEST_F(DriveGateNode, AnAbsurdSetPointIsRefusedAndAFastOneScaled) {
  const auto rejected = [&] {
    robot.run(0.1);
    return robot.lastState().rejected_set_points;
  };
  const auto before = rejected();
  geometry_msgs::Twist twist;
  twist.linear.x = 1e300;
  robot.publishOnce(twist);
  EXPECT_EQ(rejected(), before + 1);
  EXPECT_EQ(robot.states().back().set_point_forward, kSpeed);
  robot.command(6.0, 3.0);
  robot.run(0.2);
  EXPECT_NEAR(robot.states().back().set_point_forward, 2.0, 1e-9);
  EXPECT_NEAR(robot.states().back().set_point_yaw_rate, 1.0, 1e-9);
}

TEST_F(DriveGateNode, ASecondPublisherIsNamedAndLeftTheMotors) {
  auto intruder = node.advertise<jackal_msgs::Drive>("cmd_drive", 10);
  robot.waitFor([&] { return !robot.states().empty() && robot.states().back().status == ControllerState::FAULTED; },
                "the controller to notice", 30.0);
  const std::string reason = robot.states().back().reason;
  EXPECT_NE(reason.find(ros::this_node::getName() + " on /cmd_drive"), std::string::npos) << reason;
  EXPECT_NE(reason.find("remap"), std::string::npos) << reason;
  EXPECT_LE(robot.largestCommandStep(), 20.1 * kActionPeriod / kRadius);
  robot.run(0.5);
  robot.clear();
  robot.run(1.0);
  EXPECT_TRUE(robot.drives().empty()) << "the other node has the motors";

  intruder.shutdown();
  robot.command(0.0, 0.0);
  robot.waitFor([&] { return !robot.states().empty() && robot.states().back().status == ControllerState::DRIVING; },
                "the fault to be acknowledged", 30.0);
  robot.clear();
  robot.command(kSpeed, 0.0);
  expectRecovery();
}

TEST_F(DriveGateNode, ADeadPublisherThatTheMasterListsDoesNotCount) {
  robot.rest();  // nothing is handed on while this process waits for the master
  XmlRpc::XmlRpcValue registration, response, payload;
  registration[0] = "/dead";
  registration[1] = "/cmd_drive";
  registration[2] = "jackal_msgs/Drive";
  registration[3] = "http://127.0.0.1:1/";  // nothing answers there
  ASSERT_TRUE(ros::master::execute("registerPublisher", registration, response, payload, false));
  robot.rest();
  robot.command(kSpeed, 0.0);
  robot.run(0.5);
  robot.clear();
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(1.6);  // the controller looks every 0.5 s
  while (ros::WallTime::now() < end) robot.run(0.2);
  const auto states = robot.states();
  XmlRpc::XmlRpcValue withdrawal;
  withdrawal[0] = "/dead";
  withdrawal[1] = "/cmd_drive";
  withdrawal[2] = registration[3];
  ASSERT_TRUE(ros::master::execute("unregisterPublisher", withdrawal, response, payload, false));
  ASSERT_FALSE(states.empty());
  for (const auto& state : states) ASSERT_EQ(state.status, ControllerState::DRIVING) << state.reason;
}

TEST_F(DriveGateNode, ATwistToWhichNobodyListensIsAWarning) {
  std::string told;
  const auto take = [&](const diagnostic_msgs::DiagnosticArrayConstPtr& message) {
    for (const auto& status : message->status) {
      if (status.name.find("twist/controller") == std::string::npos) continue;
      told = (status.level == diagnostic_msgs::DiagnosticStatus::WARN ? "WARN " : "") + status.message;
    }
  };
  const auto diagnostics = node.subscribe<diagnostic_msgs::DiagnosticArray>("/diagnostics", 100, take);
  auto set_point = node.advertise<geometry_msgs::Twist>("twist/jackal_AIC/set_point", 1);
  const auto expect = [&](const std::string& text) {
    const auto says = [&] {
      set_point.publish(geometry_msgs::Twist());
      robot.run(0.1);
      return told == text;
    };
    robot.waitFor(says, text, 60.0);
    EXPECT_EQ(told, text);
  };
  expect("WARN no subscriber on /twist/cmd_vel: is twist_mux running?");
  geometry_msgs::Twist last;
  const auto twists = node.subscribe<geometry_msgs::Twist>(
      "twist/cmd_vel", 1, [&](const geometry_msgs::TwistConstPtr& message) { last = *message; });
  expect("driving");
}

TEST_F(DriveGateNode, TwistOutputIsTheBodyVelocityOfTheCommand) {
  double twist_forward = 0.0, twist_yaw_rate = 0.0, forward = 0.0, yaw_rate = 0.0;  // the largest, yaw to the right
  geometry_msgs::Twist last;
  const auto twists =
      node.subscribe<geometry_msgs::Twist>("twist/cmd_vel", 100, [&](const geometry_msgs::TwistConstPtr& message) {
        last = *message;
        twist_forward = std::max(twist_forward, message->linear.x);
        twist_yaw_rate = std::min(twist_yaw_rate, message->angular.z);
      });
  const auto states =
      node.subscribe<ControllerState>("twist/jackal_AIC/state", 100, [&](const ControllerStateConstPtr& message) {
        forward = std::max(forward, 0.5 * kRadius * (message->command_left + message->command_right));
        yaw_rate = std::min(yaw_rate, kRadius * (message->command_right - message->command_left) / kEffectiveTrack);
      });
  auto set_point = node.advertise<geometry_msgs::Twist>("twist/jackal_AIC/set_point", 1);
  robot.waitFor([&] { return set_point.getNumSubscribers() > 0 && twists.getNumPublishers() > 0; }, "twist/controller");
  robot.run(0.2);
  geometry_msgs::Twist wanted;
  wanted.linear.x = 0.6;
  wanted.angular.z = -0.4;
  for (int i = 0; i < 20; ++i) {
    set_point.publish(wanted);
    robot.run(0.05);
  }
  robot.run(2.0);  // past the deadline and its brake
  EXPECT_GT(twist_forward, 0.05);
  EXPECT_LT(twist_yaw_rate, -0.05);
  EXPECT_NEAR(twist_forward, forward, 1e-9);
  EXPECT_NEAR(twist_yaw_rate, yaw_rate, 1e-9);
  EXPECT_EQ(last.linear.x, 0.0);
  EXPECT_EQ(last.angular.z, 0.0);
}

}  // namespace
}  // namespace jackal_aic::test
