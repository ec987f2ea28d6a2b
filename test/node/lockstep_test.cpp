#include <gtest/gtest.h>
#include <jackal_msgs/Drive.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <rosgraph_msgs/Clock.h>

#include <cmath>
#include <functional>

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

  /// Time at which the clock stands, once it does [ms].
  std::int64_t standstill() {
    std::int64_t last = -1;
    while (ros::ok() && last != now_) {
      last = now_;
      const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(0.2);
      while (ros::WallTime::now() < end) ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.01));
    }
    return now_;
  }

  ros::NodeHandle node_;
  ros::Subscriber clock_;
  ros::Publisher drive_;
  std::int64_t now_ = 0;  // ms
};

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

TEST_F(LockstepTest, AControllerThatIsLateFromItsFirstCommandOnIsWaitedForAndALoneCommandOnlyBriefly) {
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
  EXPECT_LT(ros::WallTime::now(), end) << "waits for somebody who spoke once";
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "lockstep_test");
  ros::NodeHandle node;
  return RUN_ALL_TESTS();
}
