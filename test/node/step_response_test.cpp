// Two controllers, standard and improved, on one plant: the test switches the plant's drive topic between them.

#include <topic_tools/MuxSelect.h>

#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

constexpr double kSpeed = 0.5;  // m/s

class StepResponse : public testing::Test {
 protected:
  /// Drives a 0.5 m/s step with one of the controllers; returns its figures from ground truth.
  sim::ResponseMetrics drive(SimulatedRobot& robot, const std::string& topic) {
    topic_tools::MuxSelect select;
    select.request.topic = topic;
    EXPECT_TRUE(ros::service::waitForService("drive_mux/select", ros::Duration(-1)));
    EXPECT_TRUE(ros::service::call("drive_mux/select", select)) << topic;
    EXPECT_TRUE(robot.waitUntilReady());
    robot.rest();
    const double start = robot.command(kSpeed, 0.0);
    robot.run(4.0);
    const auto metrics = robot.forwardStep(start, kSpeed);
    robot.rest();
    robot.stopCommanding();
    return metrics;
  }
};

TEST_F(StepResponse, BothReachTheSetPointAndImprovedSettlesFaster) {
  SimulatedRobot standard("standard/"), improved("improved/");
  const auto slow = drive(standard, "standard/cmd_drive");
  const auto fast = drive(improved, "improved/cmd_drive");
  ASSERT_TRUE(slow.stable && slow.settling);
  ASSERT_TRUE(fast.stable && fast.settling);
  EXPECT_NEAR(slow.steady_error_pct, 0.0, 1.0);
  EXPECT_NEAR(fast.steady_error_pct, 0.0, 1.0);
  EXPECT_LE(*fast.settling, 0.8 * *slow.settling);
  RecordProperty("standard_settling_ms", static_cast<int>(1000 * *slow.settling));
  RecordProperty("improved_settling_ms", static_cast<int>(1000 * *fast.settling));
  ROS_INFO("settling: standard %.3f s, improved %.3f s", *slow.settling, *fast.settling);
}

}  // namespace
}  // namespace jackal_aic::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "step_response_test");
  ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
