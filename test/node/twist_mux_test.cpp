// Output twist behind twist_mux, where a joystick takes the motors and gives them back.

#include <algorithm>
#include <cmath>
#include <string>

#include "jackal_aic/model/skid_steer_kinematics.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

constexpr double kSpeed = 0.5;         // m/s
constexpr double kTakeOver = 3.0;      // s
constexpr double kMuxTimeout = 0.5;    // s for which a silent joystick keeps its priority
constexpr double kStopTimeout = 0.25;  // s without a twist after which the stock velocity controller stops the wheels

/// twist_mux and the stock velocity controller: hands the robot a joystick's wish or the controller's, at its pace.
class Mux {
 public:
  Mux() : subscriber_(node_.subscribe("cmd_vel", 10, &Mux::onTwist, this)) {}

  void takeOver(double forward, double yaw_rate) {
    joystick_.linear.x = forward;
    joystick_.angular.z = yaw_rate;
    taken_ = true;
  }

  /// The joystick falls silent. @param gap time for which it keeps its priority all the same [s].
  void giveBack(double gap) {
    taken_ = false;
    until_ = ros::Time::now() + ros::Duration(gap);
  }

  /// Largest change of a wheel speed handed to the robot from one message to the next since the last call [rad/s].
  double largestStep() {
    const double largest = largest_step_;
    largest_step_ = 0.0;
    return largest;
  }

 private:
  void onTwist(const geometry_msgs::Twist& twist) {
    const ros::Time now = ros::Time::now();
    if (taken_) letThrough(joystick_, now);
    if (!taken_ && now >= until_) letThrough(twist, now);
    if (now - last_time_ > ros::Duration(kStopTimeout)) last_ = {};
    hand(SkidSteerKinematics{GeometryParameters{}}.wheelSpeeds(last_.linear.x, last_.angular.z));
  }

  void letThrough(const geometry_msgs::Twist& twist, const ros::Time& now) {
    last_ = twist;
    last_time_ = now;
    output_.publish(twist);
  }

  void hand(const WheelCommand& command) {
    largest_step_ =
        std::max({largest_step_, std::abs(command.left - wheels_.left), std::abs(command.right - wheels_.right)});
    wheels_ = command;
    jackal_msgs::Drive drive;
    drive.mode = jackal_msgs::Drive::MODE_VELOCITY;
    drive.drivers[jackal_msgs::Drive::LEFT] = static_cast<float>(command.left);
    drive.drivers[jackal_msgs::Drive::RIGHT] = static_cast<float>(command.right);
    drive_.publish(drive);
  }

  ros::NodeHandle node_;
  ros::Publisher output_ = node_.advertise<geometry_msgs::Twist>("jackal_velocity_controller/cmd_vel", 10);
  ros::Publisher drive_ = node_.advertise<jackal_msgs::Drive>("cmd_drive", 10);
  ros::Subscriber subscriber_;
  geometry_msgs::Twist joystick_, last_;
  ros::Time last_time_, until_;
  WheelCommand wheels_;
  double largest_step_ = 0.0;
  bool taken_ = false;
};

// The first: no multiplexer was ever there. Wheels that stand although they are commanded look like those of a robot
// that another node drives.
TEST(WithoutTwistMux, TheStateSaysThatNobodyListens) {
  SimulatedRobot robot;
  ASSERT_TRUE(robot.waitUntilReady());
  robot.rest();
  robot.command(kSpeed, 0.0);
  robot.run(2.0);
  EXPECT_NEAR(robot.truth().forward.back(), 0.0, 0.02);
  robot.clear();
  robot.run(1.0);
  for (const ControllerState& state : robot.states()) {
    ASSERT_EQ(state.status, ControllerState::DRIVING);
    ASSERT_EQ(state.reason, "no subscriber on /cmd_vel: is twist_mux running?");
    ASSERT_EQ(state.driven_by, ControllerState::BY_NOBODY);
  }
  robot.rest();
  robot.stopCommanding();
}

class TwistMux : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(robot.waitUntilReady());
    robot.rest();
    robot.command(kSpeed, 0.0);
    robot.run(3.0);
    ASSERT_NEAR(robot.truth().forward.back(), kSpeed, 0.05 * kSpeed);
    robot.clear();
  }

  void TearDown() override {
    robot.rest();
    robot.stopCommanding();
  }

  /// Expects that the controller drove all the time: no brake, no stop, no latch.
  void expectUninterrupted() {
    for (const auto& state : robot.states()) {
      ASSERT_EQ(state.status, ControllerState::DRIVING) << state.reason << " at " << state.header.stamp;
    }
  }

  /// Lets the joystick drive while the set point goes on.
  void joystickDrives(double forward, double yaw_rate) {
    mux.takeOver(forward, yaw_rate);
    robot.run(kTakeOver);
    expectUninterrupted();
    if (told) {
      EXPECT_NEAR(robot.truth().forward.back(), forward, 0.05);
      EXPECT_NE(robot.states().back().reason.find("another source"), std::string::npos) << robot.states().back().reason;
    }
    mux.largestStep();
    robot.clear();
  }

  /// Expects that the robot takes up its set point by itself, without a jump or an overshoot.
  void expectTakenBack(double duration) {
    robot.run(duration);
    expectUninterrupted();
    EXPECT_NEAR(robot.truth().forward.back(), kSpeed, 0.05 * kSpeed) << robot.states().back().reason;
    EXPECT_NEAR(robot.truth().yaw_rate.back(), 0.0, 0.05);
    EXPECT_LE(*std::max_element(robot.truth().forward.begin(), robot.truth().forward.end()), 1.3 * kSpeed);
    if (told) {
      EXPECT_TRUE(robot.states().back().reason.empty()) << robot.states().back().reason;
    }
  }

  const bool told = ros::param::param<std::string>("~told", "cmd_drive") != "nothing";
  SimulatedRobot robot;
  Mux mux;
};

TEST_F(TwistMux, DrivesOnWhenAJoystickGivesTheMotorsBack) {
  joystickDrives(0.2, 0.6);
  mux.giveBack(0.0);
  expectTakenBack(4.0);
  EXPECT_LE(mux.largestStep(), 20.1 * kActionPeriod / 0.098) << "no jump beyond the limit of the acceleration";
}

TEST_F(TwistMux, DrivesOnAfterTheSilenceInWhichTheJoystickKeepsItsPriority) {
  joystickDrives(-0.3, 0.0);
  mux.giveBack(kMuxTimeout);
  expectTakenBack(5.0);
}

TEST_F(TwistMux, AJoystickMayStopTheRobot) {
  joystickDrives(0.0, 0.0);
  mux.giveBack(0.0);
  expectTakenBack(4.0);
}

// The multiplexer cannot tell the two apart: both have the motors in turns.
TEST_F(TwistMux, ASecondPublisherOfItsOwnTopicIsNamedAndLeftTheMotors) {
  ros::NodeHandle node;
  auto intruder = node.advertise<geometry_msgs::Twist>("cmd_vel", 10);
  robot.waitFor([&] { return robot.lastState().status == ControllerState::FAULTED; }, "the controller to notice", 30.0);
  const std::string reason = robot.states().back().reason;
  EXPECT_NE(reason.find(ros::this_node::getName() + " on /cmd_vel"), std::string::npos) << reason;
  intruder.shutdown();
  robot.command(0.0, 0.0);
  robot.waitFor([&] { return robot.lastState().status == ControllerState::DRIVING; }, "its acknowledgement", 30.0);
}

}  // namespace
}  // namespace jackal_aic::test
