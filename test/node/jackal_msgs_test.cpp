#include <gtest/gtest.h>
#include <jackal_msgs/Drive.h>
#include <jackal_msgs/DriveFeedback.h>
#include <jackal_msgs/Feedback.h>
#include <jackal_msgs/Status.h>
#include <ros/message_traits.h>

namespace {

// The sums of Clearpath's own package: with them a robot's nodes and ours accept each other's messages.
template <class Message>
std::string md5() {
  return ros::message_traits::MD5Sum<Message>::value();
}

TEST(JackalMsgs, AreWireCompatibleWithTheRobots) {
  EXPECT_EQ(md5<jackal_msgs::Drive>(), "601cf097cd47c174590c366c6ddd5fb3");
  EXPECT_EQ(md5<jackal_msgs::DriveFeedback>(), "8dd0b7a3cfa20cfc5c054ddd9763609b");
  EXPECT_EQ(md5<jackal_msgs::Feedback>(), "3bdabb0ef46338ee5672d1b82220ab49");
  EXPECT_EQ(md5<jackal_msgs::Status>(), "c851ebcf9a6e20b196bc7894e285b4f6");
}

TEST(JackalMsgs, CommandModesAreTheFirmwares) {
  EXPECT_EQ(jackal_msgs::Drive::MODE_VELOCITY, 0);
  EXPECT_EQ(jackal_msgs::Drive::MODE_PWM, 1);
  EXPECT_EQ(jackal_msgs::Drive::MODE_EFFORT, 2);
  EXPECT_EQ(jackal_msgs::Drive::MODE_NONE, -1);
  EXPECT_EQ(jackal_msgs::Drive::LEFT, 0);
  EXPECT_EQ(jackal_msgs::Drive::RIGHT, 1);
}

}  // namespace
