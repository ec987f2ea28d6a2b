// One controller on one plant, through everything that can happen on the topics.

#include <nav_msgs/Odometry.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <std_srvs/Empty.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "jackal_aic/odometry/odometry.hpp"
#include "relay.hpp"
#include "service_call.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

constexpr double kSpeed = 0.5;         // m/s
constexpr double kTurn = 0.5;          // rad/s
constexpr double kDeceleration = 3.0;  // m/s^2, brake.linear_deceleration
const double kNaN = std::numeric_limits<double>::quiet_NaN();

class ControllerNodeTest : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(robot.waitUntilReady());
    ASSERT_TRUE(robot.waitFor([this] { return wheels.heard() && imu.heard(); }, "the controller to listen"));
    robot.rest();
  }

  void TearDown() override {
    robot.rest();
    robot.stopCommanding();
  }

  /// Drives straight ahead until the speed is steady.
  void cruise() {
    robot.command(kSpeed, 0.0);
    const auto fast = [this] {
      const auto& speeds = robot.truth().forward;
      return !speeds.empty() && std::abs(speeds.back() - kSpeed) < 0.05 * kSpeed;
    };
    ASSERT_TRUE(robot.waitFor(fast, "the set point to be reached", 10.0));
    robot.run(2.5);
    ASSERT_NEAR(robot.truth().forward.back(), kSpeed, 0.05 * kSpeed);
  }

  static bool still(const ControllerState& state) { return state.command_left == 0.0 && state.command_right == 0.0; }
  static bool braking(const ControllerState& state) { return state.status == ControllerState::BRAKING; }
  static bool stopped(const ControllerState& state) { return state.status == ControllerState::STOPPED && still(state); }
  static bool driving(const ControllerState& state) { return state.status == ControllerState::DRIVING; }

  /// Expects a brake after the deadline, a stop within its time, and no jump on the way.
  void expectBrakeAndStop(double last_input, double deadline, const std::string& word) {
    const ControllerState* brake = robot.firstState(last_input, braking);
    ASSERT_NE(brake, nullptr) << "drove on";
    const double time = brake->header.stamp.toSec();
    EXPECT_GE(time, last_input + deadline - 0.05 - kActionPeriod);
    EXPECT_LE(time, last_input + deadline + 5 * kActionPeriod);
    EXPECT_NE(brake->reason.find(word), std::string::npos) << brake->reason;
    const ControllerState* stop = robot.firstState(time, stopped);
    ASSERT_NE(stop, nullptr);
    EXPECT_LE(stop->header.stamp.toSec(), time + kSpeed / kDeceleration + 3 * kActionPeriod);
    EXPECT_NE(stop->reason.find(word), std::string::npos) << stop->reason;
    EXPECT_NEAR(robot.truth().forward.back(), 0.0, 0.01);
    EXPECT_LT(robot.largestCommandStep(), 1.0) << "a brake must be free of jumps";
  }

  /// Silences a sensor while driving and expects the robot to stop within deadline and margin, then to drive again.
  template <class Message>
  void expectStopWithout(Relay<Message>& sensor, const std::string& word) {
    cruise();
    sensor.silence();
    robot.run(1.5);
    expectBrakeAndStop(sensor.last(), 0.2, word);

    robot.clear();
    sensor.alter = nullptr;
    robot.run(2.5);
    EXPECT_TRUE(driving(robot.states().back()));
    EXPECT_NEAR(robot.truth().forward.back(), kSpeed, 0.05 * kSpeed);
    EXPECT_LT(robot.largestCommandStep(), 1.0) << "recovery must be free of jumps";
  }

  /// Mean since a time [s]: one value has a standard deviation of 0.004 rad/s by the gyro's noise.
  double meanBeliefYawRate(double since) const {
    double sum = 0.0, count = 0.0;
    for (const ControllerState& state : robot.states()) {
      if (state.header.stamp.toSec() < since) continue;
      sum += state.belief_yaw_rate.at(0);
      ++count;
    }
    return sum / count;
  }

  ros::NodeHandle node;
  SimulatedRobot robot;
  Relay<sensor_msgs::JointState> wheels{node, "joint_states", "relayed/joint_states"};
  Relay<sensor_msgs::Imu> imu{node, "imu/data", "relayed/imu"};
};

TEST_F(ControllerNodeTest, TurnsBothWaysAtTheSetPoint) {
  for (double sign : {1.0, -1.0}) {
    robot.rest();
    const double start = robot.command(0.0, sign * kTurn);
    robot.run(4.0);
    // The thesis' belief trusts its virtual width; the robot's true one differs by a few percent.
    EXPECT_NEAR(robot.mean(robot.truth().yaw_rate, start + 3.0, start + 4.0), sign * kTurn, 0.05 * kTurn);
    EXPECT_NEAR(robot.mean(robot.truth().forward, start + 3.0, start + 4.0), 0.0, 0.01);
    EXPECT_NEAR(meanBeliefYawRate(start + 3.0), sign * kTurn, 0.02 * kTurn);
  }
}

TEST_F(ControllerNodeTest, DrivesAnArc) {
  const double start = robot.command(kSpeed, kTurn);
  robot.run(4.0);
  EXPECT_NEAR(robot.mean(robot.truth().forward, start + 3.0, start + 4.0), kSpeed, 0.02 * kSpeed);
  EXPECT_NEAR(robot.mean(robot.truth().yaw_rate, start + 3.0, start + 4.0), kTurn, 0.15 * kTurn);
}

TEST_F(ControllerNodeTest, OdometryIsWhatTheRobotDoesAndNotWhatItShouldDo) {
  std::vector<nav_msgs::Odometry> odometry;
  const auto subscriber = node.subscribe<nav_msgs::Odometry>(
      "odom", 1000, [&](const nav_msgs::OdometryConstPtr& message) { odometry.push_back(*message); });
  robot.waitFor([&] { return !odometry.empty(); }, "odometry");
  const double start = robot.command(0.0, kTurn);
  robot.run(4.0);
  double sum = 0.0;
  int count = 0;
  for (const auto& message : odometry) {
    if (message.header.stamp.toSec() < start + 3.0) continue;
    sum += message.twist.twist.angular.z;
    ++count;
  }
  ASSERT_GT(count, 40) << "50 a second";
  EXPECT_NEAR(sum / count, robot.mean(robot.truth().yaw_rate, start + 3.0, start + 4.0), 0.005);
  const auto& last = odometry.back();
  EXPECT_EQ(last.header.frame_id, "odom");
  EXPECT_EQ(last.child_frame_id, "base_link");
  EXPECT_EQ(last.twist.covariance[7], 0.001) << "no sideways motion";
  EXPECT_GT(last.twist.covariance[0], 0.0);
  EXPECT_LT(last.twist.covariance[0], 0.01);
  EXPECT_GT(last.pose.covariance[35], odometry.front().pose.covariance[35]) << "the heading drifts";
}

TEST_F(ControllerNodeTest, OdometryIsOfItsStamp) {
  std::vector<nav_msgs::Odometry> odometry;
  const auto subscriber = node.subscribe<nav_msgs::Odometry>(
      "odom", 1000, [&](const nav_msgs::OdometryConstPtr& message) { odometry.push_back(*message); });
  robot.waitFor([&] { return !odometry.empty(); }, "odometry");
  for (const double speed : {1.0, 0.0}) {
    const double start = robot.command(speed, 0.0);
    robot.run(1.5);
    double sum = 0.0;
    int count = 0;
    for (const auto& message : odometry) {
      const double time = message.header.stamp.toSec();
      if (time <= start || time > start + 1.0) continue;
      sum += message.twist.twist.linear.x;
      ++count;
    }
    ASSERT_GT(count, 40);
    const double truth = robot.mean(robot.truth().forward, start, start + 1.0);
    // An early value is off by as much as the robot changes its speed by in that time, a metre per second. Tyres
    // that pull the body along make it some milliseconds late, which no wheel tells, and which the covariance has.
    EXPECT_NEAR(sum / count, truth, 0.02) << speed;
  }
}

TEST_F(ControllerNodeTest, FollowsASquareWave) {
  for (int half = 0; half < 6; ++half) {
    const double level = half % 2 == 0 ? 0.1 : 0.5;
    const double start = robot.command(level, 0.0);
    robot.run(2.0);
    EXPECT_NEAR(robot.mean(robot.truth().forward, start + 1.5, start + 2.0), level, 0.05 * kSpeed)
        << "half wave " << half;
    EXPECT_LE(std::abs(robot.states().back().command_left), 1.2 * kSpeed / 0.098);
  }
}

TEST_F(ControllerNodeTest, PublishesStampedGeneralisedMeasurementsOfAllOrders) {
  std::vector<SensorGeneralized> messages;
  const auto subscriber = node.subscribe<SensorGeneralized>(
      "sensor_generalized", 100, [&](const SensorGeneralizedConstPtr& message) { messages.push_back(*message); });
  robot.waitFor([&] { return subscriber.getNumPublishers() > 0; }, "a publisher of sensor_generalized");
  cruise();
  ASSERT_GT(messages.size(), 100u);
  for (std::size_t i = 1; i < messages.size(); ++i) {
    const double h = (messages[i].header.stamp - messages[i - 1].header.stamp).toSec();
    ASSERT_EQ(messages[i].wheel_left.size(), 4u);
    ASSERT_GT(h, 0.0);
    // (3-22): y' = (y_k - y_{k-1}) / h
    EXPECT_NEAR(messages[i].wheel_left[1], (messages[i].wheel_left[0] - messages[i - 1].wheel_left[0]) / h, 1e-6);
  }
  EXPECT_EQ(messages.back().header.frame_id, "base_link");
  EXPECT_NEAR(messages.back().wheel_right[0], kSpeed / 0.098, 0.05 * kSpeed / 0.098);
}

TEST_F(ControllerNodeTest, StatesAreStampedAndConsistent) {
  cruise();
  ASSERT_GT(robot.states().size(), 100u);
  for (std::size_t i = 1; i < robot.states().size(); ++i) {
    // Equal where a late timer catches up two periods at once.
    EXPECT_GE(robot.states()[i].header.stamp, robot.states()[i - 1].header.stamp);
    EXPECT_EQ(robot.states()[i].belief_forward.size(), 4u);
    EXPECT_GE(robot.states()[i].free_energy, 0.0);
  }
  const ControllerState& last = robot.states().back();
  EXPECT_EQ(last.set_point_forward, kSpeed);
  EXPECT_NEAR(last.belief_forward[0], kSpeed, 0.02 * kSpeed);
  ASSERT_FALSE(robot.drives().empty());
  EXPECT_EQ(robot.drives().back().mode, jackal_msgs::Drive::MODE_VELOCITY);
  EXPECT_NEAR(robot.drives().back().drivers[jackal_msgs::Drive::LEFT], kSpeed / 0.098, 0.1 * kSpeed / 0.098);
}

TEST_F(ControllerNodeTest, StopsWhenTheSetPointIsTooOld) {
  cruise();
  robot.stopCommanding();
  const double last = ros::Time::now().toSec();
  robot.run(2.0);
  expectBrakeAndStop(last, 0.5, "set point");

  robot.clear();
  robot.command(kSpeed, 0.0);
  robot.run(2.5);
  EXPECT_NEAR(robot.truth().forward.back(), kSpeed, 0.05 * kSpeed);
  EXPECT_LT(robot.largestCommandStep(), 1.0) << "recovery must be free of jumps";
}

TEST_F(ControllerNodeTest, StopsWithoutWheelSpeeds) { expectStopWithout(wheels, "wheel"); }

TEST_F(ControllerNodeTest, StopsWithoutImu) { expectStopWithout(imu, "IMU"); }

TEST_F(ControllerNodeTest, RejectsASetPointThatIsNotFinite) {
  cruise();
  const auto rejected = robot.states().back().rejected_set_points;
  const double start = ros::Time::now().toSec();
  geometry_msgs::Twist twist;
  twist.linear.x = kNaN;
  robot.publishOnce(twist);
  twist.linear.x = 1.0;
  twist.angular.z = std::numeric_limits<double>::infinity();
  robot.run(0.1);
  robot.publishOnce(twist);
  robot.run(1.0);
  EXPECT_EQ(robot.states().back().rejected_set_points, rejected + 2);
  EXPECT_TRUE(driving(robot.states().back()));
  EXPECT_NEAR(robot.mean(robot.truth().forward, start, start + 1.0), kSpeed, 0.02 * kSpeed);
}

TEST_F(ControllerNodeTest, RejectsMeasurementsThatAreNotFinite) {
  auto bad_wheels = node.advertise<sensor_msgs::JointState>("relayed/joint_states", 10);
  auto bad_imu = node.advertise<sensor_msgs::Imu>("relayed/imu", 10);
  robot.waitFor([&] { return bad_wheels.getNumSubscribers() > 0 && bad_imu.getNumSubscribers() > 0; },
                "the controller");
  cruise();
  const auto rejected = robot.states().back().rejected_measurements;
  const double start = ros::Time::now().toSec();
  sensor_msgs::JointState broken_wheels;
  broken_wheels.header.stamp = ros::Time::now();
  broken_wheels.name = {"front_left_wheel", "front_right_wheel"};
  broken_wheels.velocity = {kNaN, 5.0};
  bad_wheels.publish(broken_wheels);
  sensor_msgs::Imu broken_imu;
  broken_imu.header.stamp = ros::Time::now();
  broken_imu.header.frame_id = "imu_link";
  broken_imu.angular_velocity.z = kNaN;
  bad_imu.publish(broken_imu);
  broken_imu.angular_velocity.z = 0.0;
  broken_imu.header.frame_id = "nowhere";
  bad_imu.publish(broken_imu);
  robot.run(1.0);
  EXPECT_EQ(robot.states().back().rejected_measurements, rejected + 3);
  EXPECT_TRUE(driving(robot.states().back()));
  EXPECT_NEAR(robot.mean(robot.truth().forward, start, start + 1.0), kSpeed, 0.02 * kSpeed);
}

TEST_F(ControllerNodeTest, LeavesJointStatesOfOthersAlone) {
  auto others = node.advertise<sensor_msgs::JointState>("relayed/joint_states", 10);
  robot.waitFor([&] { return others.getNumSubscribers() > 0; }, "the controller");
  cruise();
  const auto rejected = robot.states().back().rejected_measurements;
  sensor_msgs::JointState mast;
  mast.header.stamp = ros::Time::now();
  mast.name = {"mast_pan"};
  mast.velocity = {kNaN};
  others.publish(mast);
  robot.run(0.5);
  EXPECT_EQ(robot.states().back().rejected_measurements, rejected);
  EXPECT_TRUE(driving(robot.states().back()));
}

TEST_F(ControllerNodeTest, BoundsSpeedAndDoesNotWindUp) {
  const double start = robot.command(50.0, 0.0);
  robot.run(3.0);
  double fastest = 0.0;
  for (const auto& state : robot.states()) {
    fastest = std::max(fastest, 0.098 * 0.5 * (state.command_left + state.command_right));
  }
  EXPECT_LE(fastest, 2.0 + 1e-6);
  EXPECT_GE(fastest, 1.99);
  EXPECT_NEAR(robot.mean(robot.truth().forward, start + 2.5, start + 3.0), 2.0, 0.05);
  // Without wind-up the command falls at once when less is asked.
  robot.clear();
  const double fall = robot.command(0.0, 0.0);
  robot.run(3.0);
  const ControllerState* less =
      robot.firstState(fall, [](const ControllerState& s) { return s.command_left < 0.9 * 2.0 / 0.098; });
  ASSERT_NE(less, nullptr);
  EXPECT_LE(less->header.stamp.toSec(), fall + 0.3);
}

TEST_F(ControllerNodeTest, StartsAnewWhenTheClockJumpsBack) {
  cruise();
  robot.stopCommanding();
  const ros::Time before = ros::Time::now();
  std_srvs::Empty empty;
  ASSERT_TRUE(sim::callService("plant/reset", empty));
  ASSERT_TRUE(robot.waitFor([&] { return ros::Time::now() < before; }, "the clock to jump back"));
  robot.clear();
  robot.run(0.5);
  // The controller's last words of before the jump may come after the clock's first of after it, which is near zero.
  const auto first = std::find_if(robot.states().begin(), robot.states().end(), [&](const ControllerState& state) {
    return state.header.stamp < before - ros::Duration(1.0);
  });
  ASSERT_NE(first, robot.states().end()) << "no action update after the restart";
  for (auto state = first; state != robot.states().end(); ++state) {
    // 0.5 m/s at 20 m/s^2, from when the controller came to know of the jump
    const bool brakes = (state->header.stamp - first->header.stamp).toSec() <= 0.1;
    EXPECT_TRUE(brakes || still(*state)) << "drove on after the restart without a new set point";
    EXPECT_LT(state->header.stamp, before);
  }
  EXPECT_EQ(robot.states().back().status, ControllerState::IDLE);

  robot.clear();
  const double start = robot.command(kSpeed, 0.0);
  robot.run(4.0);
  const auto metrics = robot.forwardStep(start, kSpeed);
  ASSERT_TRUE(metrics.settling);
  EXPECT_NEAR(metrics.steady_error_pct, 0.0, 1.0);
}

}  // namespace
}  // namespace jackal_aic::test
