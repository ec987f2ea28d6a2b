// Messages in, messages with their times out: every kind of fault, without a master.

#include "faulty_channel.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace jackal_aic::sim {
namespace {

constexpr double kOnset = 1.0;    // s
constexpr double kPeriod = 0.02;  // s

sensor_msgs::JointState wheelsAt(double time) {
  sensor_msgs::JointState message;
  message.header.stamp = ros::Time(time);
  message.name = {"front_left_wheel", "front_right_wheel", "rear_left_wheel", "rear_right_wheel"};
  message.velocity = {1.0 + time, 2.0 + time, 1.0 + time, 2.0 + time};
  return message;
}

sensor_msgs::Imu imuAt(double time) {
  sensor_msgs::Imu message;
  message.header.stamp = ros::Time(time);
  message.orientation.w = 1.0;
  message.angular_velocity.x = 0.1;
  message.angular_velocity.z = 0.5 + time;
  message.linear_acceleration.y = 0.2;
  message.linear_acceleration.z = 9.81;
  return message;
}

InjectedFault faultOf(FaultKind kind, double amount = 0.0, FaultChannel channel = FaultChannel::all) {
  InjectedFault fault;
  fault.kind = kind;
  fault.amount = amount;
  fault.channel = channel;
  fault.duration = 0.1;
  return fault;
}

/// What comes out, in the order of the times, of wheel messages at 50 Hz from one period before the onset on.
std::vector<TimedMessage<sensor_msgs::JointState>> sent(const InjectedFault& fault, int messages) {
  FaultyChannel<sensor_msgs::JointState> channel;
  channel.arm({fault}, kOnset, 1);
  ReleaseQueue<sensor_msgs::JointState> queue;
  std::vector<TimedMessage<sensor_msgs::JointState>> result;
  for (int i = 0; i < messages; ++i) {
    const double now = kOnset + (i - 1) * kPeriod;
    queue.add(channel.pass(now, wheelsAt(now)));
    // In between, so that a message is seen within a millisecond of its time.
    for (int k = 0; k < 20; ++k) {
      for (const auto& message : queue.takeDue(now + 0.001 * k + 1e-9)) result.push_back({now + 0.001 * k, message});
    }
  }
  return result;
}

double stampOfMessage(int i) { return kOnset + (i - 1) * kPeriod; }

TEST(FaultyChannel, LeavesMessagesAloneOutsideTheWindow) {
  FaultyChannel<sensor_msgs::JointState> channel;
  InjectedFault fault = faultOf(FaultKind::drop);
  fault.start = 0.5;
  channel.arm({fault}, kOnset, 1);
  for (const double time : {0.0, 1.0, 1.499, 1.6, 5.0}) {
    const auto batch = channel.pass(time, wheelsAt(time));
    ASSERT_EQ(batch.size(), 1u) << time;
    EXPECT_EQ(batch[0].time, time);
    EXPECT_EQ(batch[0].message.velocity, wheelsAt(time).velocity);
  }
  EXPECT_TRUE(channel.pass(1.5, wheelsAt(1.5)).empty());
  EXPECT_TRUE(channel.pass(1.599, wheelsAt(1.599)).empty());
}

TEST(FaultyChannel, DropsTheShareAskedFor) {
  InjectedFault fault = faultOf(FaultKind::drop);
  fault.share = 0.3;
  fault.duration = 1000.0;
  FaultyChannel<sensor_msgs::JointState> channel;
  int counts[2] = {};
  for (int& count : counts) {
    channel.arm({fault}, 0.0, 7);
    for (int i = 0; i < 2000; ++i) count += channel.pass(0.02 * i, wheelsAt(0.02 * i)).empty() ? 1 : 0;
  }
  EXPECT_NEAR(counts[0], 600, 60);
  EXPECT_EQ(counts[0], counts[1]) << "equal seeds must give equal runs";
}

TEST(FaultyChannel, DelaysAndKeepsTheOrder) {
  const auto result = sent(faultOf(FaultKind::delay, 0.03), 4);
  ASSERT_EQ(result.size(), 3u) << "the last one is still on its way";
  EXPECT_NEAR(result[0].time, stampOfMessage(0), 1e-6);
  EXPECT_NEAR(result[1].time, stampOfMessage(1) + 0.03, 0.002);
  for (int i = 1; i < 3; ++i) EXPECT_NEAR(result[i].message.header.stamp.toSec(), stampOfMessage(i), 1e-6);
}

TEST(FaultyChannel, Duplicates) {
  const auto result = sent(faultOf(FaultKind::duplicate, 2.0), 2);
  ASSERT_EQ(result.size(), 4u);
  for (int i = 1; i < 4; ++i) EXPECT_NEAR(result[i].message.header.stamp.toSec(), stampOfMessage(1), 1e-6);
}

TEST(FaultyChannel, SwapsNeighbours) {
  const auto result = sent(faultOf(FaultKind::reorder, 0.03), 6);
  ASSERT_GE(result.size(), 5u);
  const int order[] = {0, 2, 1, 4, 3};
  for (int i = 0; i < 5; ++i) {
    EXPECT_NEAR(result[i].message.header.stamp.toSec(), stampOfMessage(order[i]), 1e-6) << i;
  }
}

TEST(FaultyChannel, SendsBurstsTogether) {
  const auto result = sent(faultOf(FaultKind::burst, 0.06), 5);
  ASSERT_EQ(result.size(), 4u);
  for (int i = 1; i < 4; ++i) {
    EXPECT_NEAR(result[i].time, kOnset + 0.06, 0.002);
    EXPECT_NEAR(result[i].message.header.stamp.toSec(), stampOfMessage(i), 1e-6);
  }
}

TEST(FaultyChannel, FreezesValuesUnderFreshStamps) {
  const auto result = sent(faultOf(FaultKind::freeze), 4);
  for (int i = 1; i < 4; ++i) {
    EXPECT_EQ(result[i].message.velocity, wheelsAt(stampOfMessage(0)).velocity);
    EXPECT_NEAR(result[i].message.header.stamp.toSec(), stampOfMessage(i), 1e-6);
  }
}

TEST(FaultyChannel, FreezesOneSideOnly) {
  const auto result = sent(faultOf(FaultKind::freeze, 0.0, FaultChannel::left), 4);
  const auto before = wheelsAt(stampOfMessage(0)).velocity, now = wheelsAt(stampOfMessage(3)).velocity;
  EXPECT_EQ(result[3].message.velocity, (std::vector<double>{before[0], now[1], before[2], now[3]}));
}

TEST(FaultyChannel, RepeatsTheStaleMessage) {
  const auto result = sent(faultOf(FaultKind::stale), 4);
  for (int i = 1; i < 4; ++i) EXPECT_NEAR(result[i].message.header.stamp.toSec(), stampOfMessage(0), 1e-6);
}

TEST(FaultyChannel, FalsifiesStamps) {
  EXPECT_TRUE(sent(faultOf(FaultKind::stamp_zero), 2)[1].message.header.stamp.isZero());
  EXPECT_NEAR(sent(faultOf(FaultKind::stamp_shift, 10.0), 3)[2].message.header.stamp.toSec(), stampOfMessage(2) + 10.0,
              1e-6);
  EXPECT_NEAR(sent(faultOf(FaultKind::stamp_repeated), 4)[3].message.header.stamp.toSec(), stampOfMessage(0), 1e-6);
  EXPECT_NEAR(sent(faultOf(FaultKind::stamp_reversed), 4)[3].message.header.stamp.toSec(),
              stampOfMessage(0) - 3 * kPeriod, 1e-6);
}

TEST(FaultyChannel, CorruptsTheValuesOfTheChannelOnly) {
  const auto good = wheelsAt(stampOfMessage(1)).velocity;
  const auto velocity = [](FaultKind kind, double amount) {
    return sent(faultOf(kind, amount, FaultChannel::right), 2)[1].message.velocity;
  };
  EXPECT_EQ(velocity(FaultKind::bias, 0.5), (std::vector<double>{good[0], good[1] + 0.5, good[2], good[3] + 0.5}));
  EXPECT_EQ(velocity(FaultKind::scale, -1.0), (std::vector<double>{good[0], -good[1], good[2], -good[3]}));
  EXPECT_EQ(velocity(FaultKind::set, 4.0), (std::vector<double>{good[0], 4.0, good[2], 4.0}));
  EXPECT_EQ(velocity(FaultKind::huge, 0.0)[3], 1e300);
  EXPECT_TRUE(std::isnan(velocity(FaultKind::not_a_number, 0.0)[1]));
  EXPECT_FALSE(std::isnan(velocity(FaultKind::not_a_number, 0.0)[0]));
  EXPECT_TRUE(std::isinf(velocity(FaultKind::infinite, 0.0)[3]));
}

TEST(FaultyChannel, SpoilsJointStates) {
  EXPECT_EQ(sent(faultOf(FaultKind::wrong_names), 2)[1].message.name[0], "unknown_front_left_wheel");
  const auto one_side = sent(faultOf(FaultKind::one_side), 2)[1].message;
  EXPECT_EQ(one_side.name, (std::vector<std::string>{"front_left_wheel", "rear_left_wheel"}));
  EXPECT_EQ(one_side.velocity.size(), 2u);
  EXPECT_TRUE(sent(faultOf(FaultKind::no_values), 2)[1].message.velocity.empty());
}

TEST(FaultyChannel, TurnsTheImuOver) {
  FaultyChannel<sensor_msgs::Imu> channel;
  channel.arm({faultOf(FaultKind::upside_down)}, 0.0, 1);
  const auto good = imuAt(0.01);
  const auto turned = channel.pass(0.01, good).at(0).message;
  EXPECT_EQ(turned.angular_velocity.x, good.angular_velocity.x);
  EXPECT_EQ(turned.angular_velocity.z, -good.angular_velocity.z);
  EXPECT_EQ(turned.linear_acceleration.y, -good.linear_acceleration.y);
  EXPECT_EQ(turned.linear_acceleration.z, -good.linear_acceleration.z);
  EXPECT_EQ(turned.orientation.x, 1.0) << "half a turn about x";
  EXPECT_EQ(turned.orientation.w, 0.0);
}

TEST(FaultyChannel, SpoilsWhatTheRobotReports) {
  FaultyChannel<jackal_msgs::Feedback> feedback;
  feedback.arm({faultOf(FaultKind::driver_fault), faultOf(FaultKind::mode_none)}, 0.0, 1);
  const auto reported = feedback.pass(0.0, jackal_msgs::Feedback()).at(0).message;
  EXPECT_TRUE(reported.drivers[0].driver_fault);
  EXPECT_EQ(reported.actual_mode, jackal_msgs::Drive::MODE_NONE);
  FaultyChannel<jackal_msgs::Status> status;
  status.arm({faultOf(FaultKind::external_stop)}, 0.0, 1);
  EXPECT_TRUE(status.pass(0.0, jackal_msgs::Status()).at(0).message.driver_external_stop_stopped);
}

TEST(FaultyChannel, AppliesSeveralFaultsInTheirOrder) {
  FaultyChannel<geometry_msgs::Twist> channel;
  channel.arm({faultOf(FaultKind::duplicate, 1.0), faultOf(FaultKind::delay, 0.05),
               faultOf(FaultKind::bias, 1.0, FaultChannel::yaw_rate)},
              0.0, 1);
  const auto batch = channel.pass(0.0, geometry_msgs::Twist());
  ASSERT_EQ(batch.size(), 2u);
  for (const auto& entry : batch) {
    EXPECT_EQ(entry.time, 0.05);
    EXPECT_EQ(entry.message.angular.z, 1.0);
    EXPECT_EQ(entry.message.linear.x, 0.0);
  }
}

TEST(CanSuffer, KnowsWhatATopicCannotHave) {
  EXPECT_TRUE(canSuffer<sensor_msgs::JointState>(FaultKind::freeze, FaultChannel::left));
  EXPECT_FALSE(canSuffer<sensor_msgs::JointState>(FaultKind::bias, FaultChannel::gyro));
  EXPECT_FALSE(canSuffer<sensor_msgs::JointState>(FaultKind::upside_down, FaultChannel::all));
  EXPECT_FALSE(canSuffer<geometry_msgs::Twist>(FaultKind::stamp_zero, FaultChannel::all)) << "a Twist has no stamp";
  EXPECT_TRUE(canSuffer<sensor_msgs::Imu>(FaultKind::upside_down, FaultChannel::all));
  EXPECT_FALSE(canSuffer<jackal_msgs::Status>(FaultKind::driver_fault, FaultChannel::all));
}

}  // namespace
}  // namespace jackal_aic::sim
