#include <gtest/gtest.h>
#include <jackal_aic/ControllerState.h>
#include <jackal_aic/SensorGeneralized.h>
#include <jackal_msgs/Drive.h>
#include <nav_msgs/Odometry.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <rosgraph_msgs/Clock.h>
#include <sensor_msgs/JointState.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace {

constexpr std::int64_t kPeriod = 20;  // ms, parameter lockstep

/// A controller that is as late as it likes.
class LockstepTest : public testing::Test {
 protected:
  LockstepTest() {
    clock_ = node_.subscribe<rosgraph_msgs::Clock>(
        "/clock", 100000,
        [this](const rosgraph_msgs::ClockConstPtr& message) { now_ = std::llround(1e3 * message->clock.toSec()); });
    drive_ = node_.advertise<jackal_msgs::Drive>("/cmd_drive", 10);
    state_ = node_.advertise<jackal_aic::ControllerState>("/jackal_AIC/state", 10);
    taken_ = node_.advertise<jackal_aic::SensorGeneralized>("/sensor_generalized", 10);
  }

  bool waitFor(const std::function<bool()>& condition) {
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(60.0);
    while (ros::ok() && !condition() && ros::WallTime::now() < end) {
      ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.01));
    }
    return condition();
  }

  void command() {
    jackal_msgs::Drive message;
    message.mode = jackal_msgs::Drive::MODE_VELOCITY;
    drive_.publish(message);
  }

  /// Says that the last action was at this time [ms].
  void acted(std::int64_t time) {
    jackal_aic::ControllerState message;
    message.header.stamp.fromSec(1e-3 * static_cast<double>(time));
    state_.publish(message);
  }

  /// Says that the sample of this time [ms] has come.
  void taken(std::int64_t time) {
    jackal_aic::SensorGeneralized message;
    message.header.stamp.fromSec(1e-3 * static_cast<double>(time));
    taken_.publish(message);
  }

  /// Time at which the clock stands, once it does [ms].
  std::int64_t standstill() {
    std::int64_t last = -1;
    ros::WallTime since;
    const auto stands = [&] {
      if (last != now_) since = ros::WallTime::now();
      last = now_;
      return ros::WallTime::now() - since > ros::WallDuration(0.2);
    };
    EXPECT_TRUE(waitFor(stands)) << "the clock goes on";
    return now_;
  }

  ros::NodeHandle node_;
  ros::Subscriber clock_;
  ros::Publisher drive_, state_, taken_;
  std::int64_t now_ = 0;  // ms
};

// Ground truth comes at 100 Hz, joint states and IMU data at 50.
TEST_F(LockstepTest, TheClockComesWithEverySampleAndHardlyElse) {
  std::vector<ros::Time> clocks, samples;
  const auto clock = node_.subscribe<rosgraph_msgs::Clock>(
      "/clock", 100000, [&](const rosgraph_msgs::ClockConstPtr& message) { clocks.push_back(message->clock); });
  const auto joints = node_.subscribe<sensor_msgs::JointState>(
      "/joint_states", 1000, [&](const sensor_msgs::JointStateConstPtr& m) { samples.push_back(m->header.stamp); });
  const auto truth = node_.subscribe<nav_msgs::Odometry>(
      "/ground_truth/odom", 1000, [&](const nav_msgs::OdometryConstPtr& m) { samples.push_back(m->header.stamp); });
  ASSERT_TRUE(waitFor([&] { return samples.size() > 300 && clocks.size() > 10; }));
  const ros::Time from = clocks.front(), until = clocks.back();
  for (const ros::Time& sample : samples) {
    if (sample < from || sample > until) continue;
    EXPECT_TRUE(std::binary_search(clocks.begin(), clocks.end(), sample)) << "sample at " << sample;
  }
  EXPECT_LT(static_cast<double>(clocks.size()), 160.0 * (until - from).toSec());
}

TEST_F(LockstepTest, EachCommandLetsOnePeriodPassAndSilenceIsNotWaitedForLong) {
  ASSERT_TRUE(waitFor([this] { return now_ > 0 && drive_.getNumSubscribers() > 0; }));
  const std::int64_t start = now_;
  ASSERT_TRUE(waitFor([&] { return now_ > start + 10 * kPeriod; })) << "waits for a controller that never spoke";

  command();
  command();
  const std::int64_t held = standstill();
  for (int i = 1; i <= 5; ++i) {
    command();
    ASSERT_TRUE(waitFor([&] { return now_ >= held + i * kPeriod; })) << "command " << i;
    EXPECT_EQ(standstill(), held + i * kPeriod);
  }
  EXPECT_TRUE(waitFor([&] { return now_ > held + 20 * kPeriod; }))
      << "waits for ever for a controller that fell silent";
}

TEST_F(LockstepTest, AnActionCountsFromWhenItWasNotFromWhenItsCommandCame) {
  ASSERT_TRUE(waitFor([this] { return now_ > 0 && drive_.getNumSubscribers() > 0 && state_.getNumSubscribers() > 0; }));
  command();
  command();
  std::int64_t held = standstill();
  for (const std::int64_t late : {7, 7, 0, 15}) {
    acted(held - late);
    command();
    ASSERT_TRUE(waitFor([&] { return now_ >= held - late + kPeriod; })) << "late by " << late << " ms";
    EXPECT_EQ(standstill(), held - late + kPeriod) << "late by " << late << " ms";
    held = now_;
  }
  // Neither another clock's time nor one to come is an action's; after them the command tells again.
  acted(held - 1000);
  acted(held + 10);
  EXPECT_EQ(standstill(), held);
  command();
  ASSERT_TRUE(waitFor([&] { return now_ >= held + kPeriod; }));
  EXPECT_EQ(standstill(), held + kPeriod);
}

TEST_F(LockstepTest, WaitsForALateControllerAndOnlyBrieflyForALoneCommand) {
  ASSERT_TRUE(waitFor([this] { return now_ > 0 && drive_.getNumSubscribers() > 0; }));
  constexpr int kCommands = 10;
  const std::int64_t start = now_;
  for (int i = 0; i < kCommands; ++i) {
    command();
    const ros::WallTime late = ros::WallTime::now() + ros::WallDuration(5e-3 * kPeriod);
    while (ros::WallTime::now() < late) ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.01));
  }
  EXPECT_LE(now_, start + (kCommands + 2) * kPeriod) << "went on without it";
  ASSERT_TRUE(waitFor([&] { return now_ > start + 3 * kCommands * kPeriod; }));

  command();
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(2.0);
  const std::int64_t alone = now_;
  ASSERT_TRUE(waitFor([&] { return now_ > alone + 10 * kPeriod; }));
  EXPECT_LT(ros::WallTime::now(), end) << "waits for a node that spoke once";
}

// Patience with who does not speak in its stride is 0.25 s.
TEST_F(LockstepTest, WaitsForAControllerThatActsWithTheNextClock) {
  std::int64_t sample = 0, to_act_after = 0;
  bool takes = true, acts = true;
  int samples = 0;
  const auto joints = node_.subscribe<sensor_msgs::JointState>(
      "/joint_states", 1000, [&](const sensor_msgs::JointStateConstPtr& message) {
        sample = to_act_after = std::llround(1e3 * message->header.stamp.toSec());
        ++samples;
        takes = samples != 20;
        acts = samples < 40;
        if (takes) taken(sample);
      });
  const auto clock =
      node_.subscribe<rosgraph_msgs::Clock>("/clock", 100000, [&](const rosgraph_msgs::ClockConstPtr& message) {
        const std::int64_t now = std::llround(1e3 * message->clock.toSec());
        if (!acts || to_act_after == 0 || now <= to_act_after) return;
        to_act_after = 0;
        command();
        acted(now);
      });
  const auto stall = [&] { ros::WallDuration(0.05).sleep(); };  // of everything here, shorter than the patience
  ASSERT_TRUE(waitFor([&] { return !takes; }));
  stall();
  ros::getGlobalCallbackQueue()->callAvailable();
  EXPECT_EQ(now_, sample) << "the clock has gone on without who has not taken the sample";
  taken(sample);

  ASSERT_TRUE(waitFor([&] { return !acts && now_ > sample; }));
  const std::int64_t next = now_;
  stall();
  ros::getGlobalCallbackQueue()->callAvailable();
  EXPECT_EQ(now_, next) << "the clock has gone on without who has not acted";
  const int before = samples;
  EXPECT_TRUE(waitFor([&] { return samples > before + 20; })) << "waits for ever";
}

}  // namespace
