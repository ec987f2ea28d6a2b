// The watchdog of the wheels' topics without a simulation, as on a robot.

#include <gtest/gtest.h>
#include <ros/ros.h>
#include <std_msgs/Float64.h>

#include <string>

namespace jackal_aic::test {
namespace {

/// One wheel: what it is told, by whomever, and the time [s].
struct Wheel {
  explicit Wheel(ros::NodeHandle& node, const std::string& topic)
      : publisher(node.advertise<std_msgs::Float64>(topic, 1)),
        subscriber(node.subscribe<std_msgs::Float64>(topic, 100, [this](const std_msgs::Float64ConstPtr& message) {
          if (message->data == 0.0 && told != 0.0) stopped = ros::SteadyTime::now();
          told = message->data;
        })) {}

  void command(double speed) {
    std_msgs::Float64 message;
    message.data = speed;
    publisher.publish(message);
    commanded = ros::SteadyTime::now();
  }

  double told = 0.0;
  ros::SteadyTime commanded, stopped;
  ros::Publisher publisher;
  ros::Subscriber subscriber;
};

TEST(WheelWatchdogOnWallTime, StopsOnlyTheWheelWhoseCommandsStayAway) {
  ros::NodeHandle node;
  Wheel left(node, "jackal_left_wheel/command"), right(node, "jackal_right_wheel/command");
  const auto wait = [](const auto& condition, bool& left_goes_on, Wheel& wheel) {
    const ros::SteadyTime end = ros::SteadyTime::now() + ros::WallDuration(60.0);
    while (ros::SteadyTime::now() < end && !condition()) {
      if (left_goes_on) wheel.command(3.0);
      ros::spinOnce();
      ros::WallDuration(0.01).sleep();
    }
    return condition();
  };
  bool goes_on = true;
  ASSERT_TRUE(wait([&] { return left.publisher.getNumSubscribers() > 1 && right.publisher.getNumSubscribers() > 1; },
                   goes_on, left));
  right.command(-2.0);
  ASSERT_TRUE(wait([&] { return right.told == -2.0 && left.told == 3.0; }, goes_on, left));
  ASSERT_TRUE(wait([&] { return right.told == 0.0; }, goes_on, left)) << "the right wheel goes on for ever";
  EXPECT_GE((right.stopped - right.commanded).toSec(), 0.25);
  EXPECT_EQ(left.told, 3.0) << "its commands go on";
  goes_on = false;
  ASSERT_TRUE(wait([&] { return left.told == 0.0; }, goes_on, left));
  EXPECT_GE((left.stopped - left.commanded).toSec(), 0.25);
}

}  // namespace
}  // namespace jackal_aic::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "wheel_watchdog_wall_time_test");
  ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
