// The same step on the ROS path (nodes, topics, timers) and in the closed loop without ROS.

#include "../closed_loop/step_response.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

constexpr double kSpeed = 0.5;  // m/s

sim::ResponseMetrics offlineStep() {
  const sim::PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return sim::runSetup(sim::loadSetup(files, "standard", "ground", {}), sim::stepProfile(kSpeed, 0.0, 4.0)).metrics;
}

TEST(OfflineAgreement, SettlingAndRiseWithinTenPercent) {
  SimulatedRobot robot;
  ASSERT_TRUE(robot.waitUntilReady());
  robot.rest();
  const double start = robot.command(kSpeed, 0.0);
  robot.run(4.0);
  const auto ros_path = robot.forwardStep(start, kSpeed);
  const auto offline = offlineStep();
  ASSERT_TRUE(ros_path.settling && ros_path.rise && offline.settling && offline.rise);
  EXPECT_NEAR(*ros_path.settling / *offline.settling, 1.0, 0.1);
  EXPECT_NEAR(*ros_path.rise / *offline.rise, 1.0, 0.1);
  EXPECT_NEAR(ros_path.steady_error_pct, offline.steady_error_pct, 0.5);
  ROS_INFO("ROS path: settling %.3f s, rise %.3f s, overshoot %.2f %%; offline: %.3f s, %.3f s, %.2f %%",
           *ros_path.settling, *ros_path.rise, ros_path.overshoot_pct, *offline.settling, *offline.rise,
           offline.overshoot_pct);
  RecordProperty("ros_settling_ms", static_cast<int>(1000 * *ros_path.settling));
  RecordProperty("offline_settling_ms", static_cast<int>(1000 * *offline.settling));
}

}  // namespace
}  // namespace jackal_aic::test
