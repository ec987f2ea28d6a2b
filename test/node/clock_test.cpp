// A clock that does not go is told, in one line.

#include <gtest/gtest.h>
#include <ros/ros.h>
#include <rosgraph_msgs/Clock.h>

#include <string>

#include "controller_process.hpp"

namespace jackal_aic::test {
namespace {

class ClockTest : public testing::Test {
 protected:
  ClockTest() : clock_(node_.advertise<rosgraph_msgs::Clock>("/clock", 10)), controller_("clockless") {}

  /// Waits until the controller says something; the limit [s] is for a busy machine.
  bool says(const std::string& words, double longest = 20.0) const {
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(longest);
    const auto said = [&] { return controller_.errors().find(words) != std::string::npos; };
    while (!said() && ros::WallTime::now() < end) ros::WallDuration(0.05).sleep();
    return said();
  }

  int timesSaid(const std::string& words) const {
    const std::string text = controller_.errors();
    int count = 0;
    for (std::size_t i = text.find(words); i != std::string::npos; i = text.find(words, i + 1)) ++count;
    return count;
  }

  ros::NodeHandle node_;
  ros::Publisher clock_;
  ControllerProcess controller_;
};

TEST_F(ClockTest, NoClockAndOneThatStandsStillAreToldOnce) {
  ASSERT_TRUE(says("No clock: /use_sim_time is true and nothing came on /clock for 3 s")) << controller_.errors();
  for (int i = 0; i < 10; ++i) {
    rosgraph_msgs::Clock message;
    message.clock = ros::Time(5.0 + 0.1 * i);
    clock_.publish(message);
    ros::WallDuration(0.1).sleep();
  }
  ASSERT_TRUE(says("The clock stands still at 5.900 s")) << controller_.errors();
  ros::WallDuration(4.0).sleep();
  EXPECT_EQ(timesSaid("No clock:"), 1);
  EXPECT_EQ(timesSaid("The clock stands still"), 1);
}

}  // namespace
}  // namespace jackal_aic::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "clock_test");
  ros::NodeHandle node;
  return RUN_ALL_TESTS();
}
