// Three controllers, standard, improved and predictive, on one plant: the test switches the plant's drive topic between
// them.

#include <topic_tools/MuxSelect.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "service_call.hpp"
#include "simulated_robot.hpp"

namespace jackal_aic::test {
namespace {

constexpr double kSpeed = 0.5;  // m/s

constexpr int kSteps = 3;

/// Figures of several steps.
struct Steps {
  std::vector<double> settling;    // [s], shortest first
  double largest_error_pct = 0.0;  // at steady state

  double median() const { return settling.at(settling.size() / 2); }
};

class StepResponse : public testing::Test {
 protected:
  /// Gives the motors to one of the controllers.
  void giveMotors(SimulatedRobot& robot, const std::string& topic) {
    topic_tools::MuxSelect select;
    select.request.topic = topic;
    EXPECT_TRUE(sim::callService("drive_mux/select", select)) << topic;
    EXPECT_TRUE(robot.waitUntilReady());
  }

  /// Drives 0.5 m/s steps from rest with one of the controllers; figures from ground truth.
  Steps drive(SimulatedRobot& robot, const std::string& topic) {
    giveMotors(robot, topic);
    Steps steps;
    for (int i = 0; i < kSteps; ++i) {
      robot.rest();
      const double start = robot.command(kSpeed, 0.0);
      robot.run(4.0);
      const auto metrics = robot.forwardStep(start, kSpeed);
      EXPECT_TRUE(metrics.stable && metrics.settling);
      steps.settling.push_back(metrics.settling.value_or(4.0));
      steps.largest_error_pct = std::max(steps.largest_error_pct, std::abs(metrics.steady_error_pct));
    }
    robot.rest();
    robot.stopCommanding();
    std::sort(steps.settling.begin(), steps.settling.end());
    return steps;
  }
};

/// Largest value of a series along a sign.
double largest(const std::vector<double>& series, double sign) {
  double most = 0.0;
  for (const double value : series) most = std::max(most, sign * value);
  return most;
}

// The bars of stop_table.hpp through the nodes. A turn's share of the overshoot that is the effective track's, not
// known yet, is 3 % in place and 7 % on the arc, which predictive has learned to 5 % by then.
// Predictive drives first: what it would learn of the track while another one has the motors, and it does not know, is
// not what is judged here.
TEST_F(StepResponse, NoneWindsUpAndNoneRunsBackAfterAStop) {
  struct Bars {
    const char* controller;
    double step_pct, arc_pct;
  };
  for (const Bars& bars : {Bars{"predictive", 5.0, 8.0}, Bars{"standard", 12.0, 12.0}, Bars{"improved", 10.0, 10.0}}) {
    SimulatedRobot robot(std::string(bars.controller) + "/");
    giveMotors(robot, std::string(bars.controller) + "/cmd_drive");
    for (const auto& [forward, yaw_rate] : {std::pair(1.0, 0.0), std::pair(0.5, 0.5), std::pair(0.0, 1.0)}) {
      SCOPED_TRACE(std::string(bars.controller) + ", " + std::to_string(forward) + " m/s, " + std::to_string(yaw_rate) +
                   " rad/s");
      robot.rest();
      robot.command(forward, yaw_rate);
      robot.run(3.0);
      const Recording driven = robot.truth();
      ASSERT_FALSE(driven.time.empty());
      EXPECT_NEAR(driven.forward.back(), forward, 0.05);
      EXPECT_NEAR(driven.yaw_rate.back(), yaw_rate, 0.1);
      const double part = 0.01 * (forward != 0.0 && yaw_rate != 0.0 ? bars.arc_pct : bars.step_pct);
      if (forward != 0.0) {
        EXPECT_LE(largest(driven.forward, 1.0), (1.0 + 0.01 * bars.step_pct) * forward);
      }
      if (yaw_rate != 0.0) {
        EXPECT_LE(largest(driven.yaw_rate, 1.0), (1.0 + part) * yaw_rate);
      }
      robot.clear();
      robot.command(0.0, 0.0);
      robot.run(2.5);
      ASSERT_FALSE(robot.truth().time.empty());
      EXPECT_LE(largest(robot.truth().forward, -1.0), 0.03);
      EXPECT_LE(largest(robot.truth().yaw_rate, -1.0), 0.05);
      EXPECT_NEAR(robot.truth().forward.back(), 0.0, 0.01);
      EXPECT_NEAR(robot.truth().yaw_rate.back(), 0.0, 0.02);
    }
    robot.stopCommanding();
  }
}

// The median of some steps: the overshoot of `improved` is at the edge of the band that settling is measured by, and on
// which side of it depends on the noise and on the phase between timers and samples.
TEST_F(StepResponse, BothReachTheSetPointAndImprovedSettlesFaster) {
  SimulatedRobot standard("standard/"), improved("improved/");
  const Steps slow = drive(standard, "standard/cmd_drive");
  const Steps fast = drive(improved, "improved/cmd_drive");
  EXPECT_LE(slow.largest_error_pct, 1.0);
  EXPECT_LE(fast.largest_error_pct, 1.0);
  EXPECT_LE(fast.median(), 0.8 * slow.median());
  RecordProperty("standard_settling_ms", static_cast<int>(1000 * slow.median()));
  RecordProperty("improved_settling_ms", static_cast<int>(1000 * fast.median()));
  ROS_INFO("settling: standard %.3f s, improved %.3f s", slow.median(), fast.median());
}

}  // namespace
}  // namespace jackal_aic::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "step_response_test");
  ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
