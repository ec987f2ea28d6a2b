#include <geometry_msgs/Wrench.h>
#include <gtest/gtest.h>
#include <jackal_msgs/Drive.h>
#include <jackal_msgs/Feedback.h>
#include <nav_msgs/Odometry.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <rosgraph_msgs/Clock.h>
#include <rosgraph_msgs/Log.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Float64.h>
#include <std_srvs/Empty.h>
#include <std_srvs/SetBool.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "service_call.hpp"

namespace {

constexpr double kWheelRadius = 0.098;  // m

/// Records what the plant says and drives it.
class PlantNodeTest : public testing::Test {
 protected:
  PlantNodeTest() {
    subscribe("/clock", &PlantNodeTest::clocks_);
    subscribe("/joint_states", &PlantNodeTest::joints_);
    subscribe("/imu/data", &PlantNodeTest::imus_);
    subscribe("/feedback", &PlantNodeTest::feedbacks_);
    subscribe("/ground_truth/odom", &PlantNodeTest::truths_);
    subscribe("/tf", &PlantNodeTest::transforms_);
    drive_ = node_.advertise<jackal_msgs::Drive>("/cmd_drive", 10);
    left_ = node_.advertise<std_msgs::Float64>("/jackal_left_wheel/command", 10);
    right_ = node_.advertise<std_msgs::Float64>("/jackal_right_wheel/command", 10);
  }

  void SetUp() override {
    ASSERT_TRUE(waitFor([this] {
      return drive_.getNumSubscribers() > 0 && left_.getNumSubscribers() > 0 && right_.getNumSubscribers() > 0 &&
             !truths_.empty() && !joints_.empty() && !imus_.empty() && !feedbacks_.empty() && !transforms_.empty();
    }));
    reset();
  }

  template <class Message>
  void subscribe(const char* topic, std::vector<Message> PlantNodeTest::*log) {
    const boost::function<void(const Message&)> callback = [this, log](const Message& m) { (this->*log).push_back(m); };
    subscribers_.push_back(node_.subscribe<Message>(topic, 5000, callback));
  }

  /// False if a condition does not come true within a minute, which is a dead plant, not a slow one.
  bool waitFor(const std::function<bool()>& condition) {
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(60.0);
    while (!condition()) {
      if (!ros::ok() || ros::WallTime::now() > end) return false;
      ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.01));
    }
    return true;
  }

  /// Time of the last clock message [s].
  double now() const { return clocks_.empty() ? 0.0 : clocks_.back().clock.toSec(); }

  /// Lets simulated time pass [s] and the rest of the messages of that time come in.
  void run(double seconds) {
    const double end = now() + seconds;
    ASSERT_TRUE(waitFor([&] { return now() >= end && truths_.back().header.stamp.toSec() >= end - 0.02; }));
  }

  /// True if the clock jumped back after its message number `from`.
  bool jumpedBack(std::size_t from) const {
    const auto earlier = [](const auto& a, const auto& b) { return b.clock < a.clock; };
    return std::adjacent_find(clocks_.begin() + static_cast<long>(from), clocks_.end(), earlier) != clocks_.end();
  }

  /// Puts the plant back to the start and waits until its messages say so.
  void reset() {
    const std::size_t last = clocks_.size() - 1;
    std_srvs::Empty request;
    ASSERT_TRUE(jackal_aic::sim::callService("/plant/reset", request));
    ASSERT_TRUE(waitFor([&] { return jumpedBack(last); })) << "the clock did not jump back";
    ASSERT_TRUE(waitFor([this] { return truths_.back().header.stamp.toSec() <= now() + 0.02; }));
    run(0.1);
  }

  void drive(double left, double right, int mode = jackal_msgs::Drive::MODE_VELOCITY) {
    jackal_msgs::Drive message;
    message.mode = static_cast<std::int8_t>(mode);
    message.drivers[jackal_msgs::Drive::LEFT] = static_cast<float>(left);
    message.drivers[jackal_msgs::Drive::RIGHT] = static_cast<float>(right);
    drive_.publish(message);
  }

  void driveAsGazebo(double left, double right) {
    std_msgs::Float64 speed;
    speed.data = left;
    left_.publish(speed);
    speed.data = right;
    right_.publish(speed);
  }

  double forward() const { return truths_.back().twist.twist.linear.x; }
  double yawRate() const { return truths_.back().twist.twist.angular.z; }

  ros::NodeHandle node_;
  std::vector<ros::Subscriber> subscribers_;
  ros::Publisher drive_, left_, right_;
  std::vector<rosgraph_msgs::Clock> clocks_;
  std::vector<sensor_msgs::JointState> joints_;
  std::vector<sensor_msgs::Imu> imus_;
  std::vector<jackal_msgs::Feedback> feedbacks_;
  std::vector<nav_msgs::Odometry> truths_;
  std::vector<tf2_msgs::TFMessage> transforms_;
};

/// Gaps between the stamps of consecutive messages, leaving out jumps back [ms].
template <class Messages, class Stamp>
std::vector<long> gaps(const Messages& messages, Stamp stamp) {
  std::vector<long> result;
  for (std::size_t i = 1; i < messages.size(); ++i) {
    const double gap = (stamp(messages[i]) - stamp(messages[i - 1])).toSec();
    if (gap > 0.0) result.push_back(std::lround(gap * 1e3));
  }
  return result;
}

TEST_F(PlantNodeTest, KeepsItsRatesOnItsOwnClock) {
  run(1.0);
  const auto header = [](const auto& message) { return message.header.stamp; };
  for (long gap : gaps(clocks_, [](const auto& m) { return m.clock; })) EXPECT_EQ(gap, 1);
  for (long gap : gaps(joints_, header)) EXPECT_EQ(gap, 20);
  for (long gap : gaps(imus_, header)) EXPECT_EQ(gap, 20);
  for (long gap : gaps(feedbacks_, header)) EXPECT_EQ(gap, 20);
  for (long gap : gaps(truths_, header)) EXPECT_EQ(gap, 10);
  for (long gap : gaps(transforms_, [](const auto& m) { return m.transforms[0].header.stamp; })) EXPECT_EQ(gap, 20);
  EXPECT_GT(joints_.size(), 50u);
}

TEST_F(PlantNodeTest, DrivesByVelocityCommands) {
  drive(0.3 / kWheelRadius, 0.3 / kWheelRadius);
  run(1.5);
  EXPECT_NEAR(forward(), 0.3, 1e-3);
  EXPECT_NEAR(joints_.back().velocity[0], 0.3 / kWheelRadius, 1e-3);
  EXPECT_EQ(feedbacks_.back().commanded_mode, jackal_msgs::Drive::MODE_VELOCITY);
  drive(-0.1 / kWheelRadius, 0.1 / kWheelRadius);
  run(1.5);
  EXPECT_GT(yawRate(), 0.2);
  EXPECT_NEAR(imus_.back().angular_velocity.z, yawRate(), 1e-2);
}

TEST_F(PlantNodeTest, ModeNoneStopsAndOtherModesAreIgnored) {
  drive(3.0, 3.0);
  drive(-1.0, -1.0, jackal_msgs::Drive::MODE_PWM);
  drive(-1.0, -1.0, jackal_msgs::Drive::MODE_EFFORT);
  run(1.5);
  EXPECT_NEAR(forward(), 3.0 * kWheelRadius, 1e-3);
  drive(5.0, 5.0, jackal_msgs::Drive::MODE_NONE);
  run(1.5);
  EXPECT_NEAR(forward(), 0.0, 1e-3);
  EXPECT_EQ(feedbacks_.back().commanded_mode, jackal_msgs::Drive::MODE_NONE);
}

TEST_F(PlantNodeTest, IgnoresCommandsThatAreNotFinite) {
  drive(3.0, 3.0);
  drive(std::numeric_limits<float>::quiet_NaN(), 3.0);
  driveAsGazebo(std::numeric_limits<double>::infinity(), 3.0);
  run(1.5);
  EXPECT_NEAR(forward(), 3.0 * kWheelRadius, 1e-3);
  EXPECT_NEAR(yawRate(), 0.0, 1e-3);
}

TEST_F(PlantNodeTest, DrivesByGazebosTopics) {
  driveAsGazebo(1.0, 3.0);
  run(1.5);
  EXPECT_NEAR(joints_.back().velocity[0], 1.0, 1e-3);
  EXPECT_NEAR(joints_.back().velocity[1], 3.0, 1e-3);
  EXPECT_GT(yawRate(), 0.1);
}

TEST_F(PlantNodeTest, StopsWhenNoCommandComes) {
  drive(3.0, 3.0);
  run(1.9);
  EXPECT_NEAR(forward(), 3.0 * kWheelRadius, 1e-3);
  run(1.5);
  EXPECT_NEAR(forward(), 0.0, 1e-3);
}

TEST_F(PlantNodeTest, BlocksAMotorAndLetsItGo) {
  std_srvs::SetBool block;
  block.request.data = true;
  ASSERT_TRUE(jackal_aic::sim::callService("/plant/block_left", block));
  drive(5.0, 5.0);
  run(1.0);
  EXPECT_NEAR(joints_.back().velocity[0], 0.0, 0.2);
  EXPECT_GT(joints_.back().velocity[1], 4.0);
  EXPECT_GT(yawRate(), 0.3);
  block.request.data = false;
  ASSERT_TRUE(jackal_aic::sim::callService("/plant/block_left", block));
  drive(5.0, 5.0);  // again: the plant stops when no command comes for 2 s
  run(1.5);
  EXPECT_GT(joints_.back().velocity[0], 4.0);
}

TEST_F(PlantNodeTest, PullsTheImuAndPlugsItIn) {
  std_srvs::SetBool pull;
  pull.request.data = true;
  ASSERT_TRUE(jackal_aic::sim::callService("/plant/pull_imu", pull));
  run(0.1);
  imus_.clear();
  run(0.5);
  EXPECT_TRUE(imus_.empty());
  pull.request.data = false;
  ASSERT_TRUE(jackal_aic::sim::callService("/plant/pull_imu", pull));
  run(0.5);
  EXPECT_GT(imus_.size(), 10u);
}

TEST_F(PlantNodeTest, IsPushedUntilItIsLetGo) {
  ros::Publisher push = node_.advertise<geometry_msgs::Wrench>("/plant/push", 10);
  ASSERT_TRUE(waitFor([&] { return push.getNumSubscribers() > 0; }));
  geometry_msgs::Wrench wrench;
  wrench.force.x = 200.0;  // more than the tyres hold
  push.publish(wrench);
  run(0.3);
  EXPECT_GT(forward(), 0.3);
  push.publish(geometry_msgs::Wrench());
  run(1.0);
  EXPECT_NEAR(forward(), 0.0, 1e-2);
}

TEST_F(PlantNodeTest, IsLiftedAndSetDown) {
  const auto height = [this] { return truths_.back().pose.pose.position.z; };
  const double low = height();
  std_srvs::SetBool lift;
  lift.request.data = true;
  ASSERT_TRUE(jackal_aic::sim::callService("/plant/lift", lift));
  run(1.5);
  EXPECT_NEAR(height(), low + 0.3, 0.02);
  lift.request.data = false;
  ASSERT_TRUE(jackal_aic::sim::callService("/plant/lift", lift));
  run(1.5);
  EXPECT_NEAR(height(), low, 0.01);
}

TEST_F(PlantNodeTest, ResetTakesItsParametersAnew) {
  const double step = 0.5;  // rad/s
  node_.setParam("/plant/plant/encoder_step", step);
  reset();
  drive(3.2, 3.2);
  const std::size_t first = joints_.size();
  run(1.5);
  ASSERT_GT(joints_.size(), first + 10);
  for (std::size_t i = first; i < joints_.size(); ++i) {
    EXPECT_NEAR(std::remainder(joints_[i].velocity[0], step), 0.0, 1e-9);
  }
  node_.setParam("/plant/plant/encoder_step", -1.0);
  std_srvs::Empty request;
  const double before = now();
  EXPECT_FALSE(ros::service::call("/plant/reset", request)) << "out of range";
  run(0.1);
  EXPECT_GE(now(), before) << "and the robot is left as it is";
  node_.deleteParam("/plant/plant/encoder_step");
}

TEST_F(PlantNodeTest, ResetNamesAParameterThatNobodyKnows) {
  std::string said;
  const auto log = node_.subscribe<rosgraph_msgs::Log>(
      "/rosout", 100, [&](const rosgraph_msgs::LogConstPtr& line) { said += line->msg + "\n"; });
  for (const std::string name : {"plant/fricton", "lockstop"}) {
    node_.setParam("/plant/" + name, 0.2);
    const std::string key = name.substr(name.find('/') + 1);
    EXPECT_TRUE(waitFor([&] {  // again until the plant's log is connected
      std_srvs::Empty request;
      EXPECT_FALSE(ros::service::call("/plant/reset", request)) << name;
      return said.find(key) != std::string::npos;
    })) << name;
    node_.deleteParam("/plant/" + name);
  }
}

TEST_F(PlantNodeTest, ResetPutsClockAndRobotBack) {
  drive(3.0, 3.0);
  run(1.5);
  EXPECT_GT(truths_.back().pose.pose.position.x, 0.1);
  const auto before = clocks_.end() - clocks_.begin();
  reset();
  const auto first = [](const auto& message) { return message.clock == ros::Time(0, 1000000); };
  EXPECT_TRUE(std::any_of(clocks_.begin() + before, clocks_.end(), first));
  EXPECT_NEAR(truths_.back().pose.pose.position.x, 0.0, 1e-6);
  EXPECT_NEAR(forward(), 0.0, 1e-5);
}

}  // namespace
