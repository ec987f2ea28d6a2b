// The action step comes right after a measurement, at whichever phase the controller was started.

#include <jackal_aic/SensorGeneralized.h>

#include <algorithm>
#include <vector>

#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

TEST(ActionPhase, FollowsTheMeasurements) {
  SimulatedRobot robot;
  std::vector<double> stamps;  // of the measurements that the controller took [s]
  ros::NodeHandle node;
  const ros::Subscriber measurements = node.subscribe<SensorGeneralized>(
      "sensor_generalized", 1000,
      [&](const SensorGeneralizedConstPtr& message) { stamps.push_back(message->header.stamp.toSec()); });
  ASSERT_TRUE(robot.waitUntilReady());
  robot.run(2.0);
  robot.clear();
  const double begin = ros::Time::now().toSec();
  robot.run(5.0);

  std::vector<double> ages, periods;
  double last = 0.0;
  for (const ControllerState& state : robot.states()) {
    const double time = state.header.stamp.toSec();
    const auto newest = std::upper_bound(stamps.begin(), stamps.end(), time);
    if (time < begin + 0.1 || newest == stamps.begin()) continue;
    ages.push_back(time - *std::prev(newest));
    if (last > 0.0) periods.push_back(time - last);
    last = time;
  }
  ASSERT_GT(periods.size(), 200u);
  std::sort(ages.begin(), ages.end());
  std::sort(periods.begin(), periods.end());
  // On a busy machine the simulation goes on for some milliseconds while a message is on its way.
  EXPECT_LE(ages[ages.size() / 2], 0.008);
  EXPECT_NEAR(periods[periods.size() / 2], kActionPeriod, 0.0011);
}

}  // namespace
}  // namespace jackal_aic::test
