// main() of the tests that talk to nodes.

#include <errno.h>
#include <gtest/gtest.h>
#include <ros/ros.h>

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, program_invocation_short_name);
  ros::NodeHandle keep_alive;  // roscpp ends with its last handle
  return RUN_ALL_TESTS();
}
