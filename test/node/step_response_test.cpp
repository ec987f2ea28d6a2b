// Three controllers, standard, improved and predictive, on one plant: the test hands on the commands of one of them.
// The test's parameter ~plant is "ground", "box" or "real".

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "simulated_robot.hpp"
#include "true_motion.hpp"

namespace jackal_aic::test {
namespace {

constexpr double kSpeed = 0.5;  // m/s

constexpr int kSteps = 3;

/// What a plant asks for beyond what the ground does.
struct PlantBars {
  double steady_error_pct;     // that the loop may leave
  double settling;             // of improved, in multiples of standard's
  double turn_pct;             // by which a turn on the spot may exceed its set point beyond the preset's own share
  double arc_pct;              // and one on an arc
  double forward_noise = 0.0;  // of what tells the motion [m/s]
  double yaw_noise = 0.0;      // [rad/s]
  double aside = 0.05;         // forward speed that a turn on the spot may have [m/s]
  double end = 0.005;          // over which the end of a drive is judged: its last sample [s]
};

/// On the box the encoders tell the motion, with three deviations of their noise, and improved's overshoot is at the
/// edge of the band that settling is measured by. On the real one the controllers know the mean radius of the tyres; by
/// patches of friction the turn changes at once by a fifth and more, and a load off centre takes the point about which
/// it turns aside; a single sample is of the wave or the joint of patches that the robot is on.
PlantBars plantBars() {
  if (plantName() == "box") return {1.0, 1.0, 0.0, 0.0, 0.007, 0.03, 0.05};
  if (plantName() == "real") return {2.0, 1.0, 15.0, 35.0, 0.01, 0.02, 0.15, 0.5};
  return {1.0, 0.8, 0.0, 0.0};
}

/// Figures of several steps.
struct Steps {
  std::vector<double> settling;    // [s], shortest first
  std::vector<double> rise;        // [s], shortest first
  double largest_error_pct = 0.0;  // at steady state

  static double median(const std::vector<double>& sorted) { return sorted.at(sorted.size() / 2); }
};

/// Hands on to the motors what one controller commands, and when it acted, so that the simulation waits for it.
class Motors {
 public:
  void give(const std::string& controller) {
    const auto hints = ros::TransportHints().tcpNoDelay();
    from_drive_ = node_.subscribe<jackal_msgs::Drive>(
        controller + "/cmd_drive", 50, [this](const jackal_msgs::DriveConstPtr& drive) { drive_.publish(drive); }, {},
        hints);
    from_state_ = node_.subscribe<ControllerState>(
        controller + "/jackal_AIC/state", 50, [this](const ControllerStateConstPtr& state) { state_.publish(state); },
        {}, hints);
  }

 private:
  ros::NodeHandle node_;
  ros::Publisher drive_ = node_.advertise<jackal_msgs::Drive>("cmd_drive", 50);
  ros::Publisher state_ = node_.advertise<ControllerState>("jackal_AIC/state", 50);
  ros::Subscriber from_drive_, from_state_;
};

class StepResponse : public testing::Test {
 protected:
  /// Gives the motors to one of the controllers.
  void giveMotors(SimulatedRobot& robot, const std::string& controller) {
    motors_.give(controller);
    EXPECT_TRUE(robot.waitUntilReady());
  }

  /// Drives 0.5 m/s steps from rest with one of the controllers; figures from ground truth.
  Steps drive(SimulatedRobot& robot, const std::string& controller) {
    giveMotors(robot, controller);
    Steps steps;
    for (int i = 0; i < kSteps; ++i) {
      rest(robot);
      const double start = robot.command(kSpeed, 0.0);
      robot.run(4.0);
      const Recording& done = truth_.of(robot);
      const auto metrics = sim::stepResponseMetrics(done.time, done.forward, start, 0.0, kSpeed);
      EXPECT_TRUE(metrics.bounded && metrics.settling && metrics.rise)
          << controller << ", step " << i << ": " << robot.lastState().summary << ", " << robot.lastState().reason;
      steps.settling.push_back(metrics.settling.value_or(4.0));
      steps.rise.push_back(metrics.rise.value_or(4.0));
      steps.largest_error_pct = std::max(steps.largest_error_pct, std::abs(metrics.steady_error_pct));
    }
    rest(robot);
    robot.stopCommanding();
    std::sort(steps.settling.begin(), steps.settling.end());
    std::sort(steps.rise.begin(), steps.rise.end());
    return steps;
  }

  void rest(SimulatedRobot& robot) {
    robot.rest();
    truth_.clear();
  }

  void clear(SimulatedRobot& robot) {
    robot.clear();
    truth_.clear();
  }

  Motors motors_;
  Truth truth_;
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
  const PlantBars plant = plantBars();
  struct Bars {
    const char* controller;
    double step_pct, arc_pct;
  };
  for (const Bars& bars : {Bars{"predictive", 5.0, 8.0}, Bars{"standard", 12.0, 12.0}, Bars{"improved", 10.0, 10.0}}) {
    SimulatedRobot robot(std::string(bars.controller) + "/");
    giveMotors(robot, bars.controller);
    for (const auto& [forward, yaw_rate] : {std::pair(1.0, 0.0), std::pair(0.5, 0.5), std::pair(0.0, 1.0)}) {
      SCOPED_TRACE(std::string(bars.controller) + ", " + std::to_string(forward) + " m/s, " + std::to_string(yaw_rate) +
                   " rad/s");
      rest(robot);
      robot.command(forward, yaw_rate);
      robot.run(3.0);
      const Recording driven = truth_.of(robot);
      ASSERT_FALSE(driven.time.empty());
      const bool arc = forward != 0.0 && yaw_rate != 0.0;
      const double turn_pct = arc ? bars.arc_pct + plant.arc_pct : bars.step_pct + plant.turn_pct;
      const double end = driven.time.back();
      EXPECT_NEAR(mean(driven, driven.forward, end - plant.end, end), forward, forward != 0.0 ? 0.05 : plant.aside);
      EXPECT_NEAR(mean(driven, driven.yaw_rate, end - plant.end, end), yaw_rate, 0.1 + 0.01 * plant.turn_pct);
      if (forward != 0.0) {
        EXPECT_LE(largest(driven.forward, 1.0), (1.0 + 0.01 * bars.step_pct) * forward + plant.forward_noise);
      }
      if (yaw_rate != 0.0) {
        EXPECT_LE(largest(driven.yaw_rate, 1.0), (1.0 + 0.01 * turn_pct) * yaw_rate + plant.yaw_noise);
      }
      clear(robot);
      robot.command(0.0, 0.0);
      robot.run(2.5);
      const Recording stopped = truth_.of(robot);
      ASSERT_FALSE(stopped.time.empty());
      EXPECT_LE(largest(stopped.forward, -1.0), forward != 0.0 ? 0.03 + plant.forward_noise : plant.aside);
      EXPECT_LE(largest(stopped.yaw_rate, -1.0), 0.05 + plant.yaw_noise);
      EXPECT_NEAR(stopped.forward.back(), 0.0, 0.01 + plant.forward_noise);
      EXPECT_NEAR(stopped.yaw_rate.back(), 0.0, 0.02 + plant.yaw_noise);
    }
    robot.stopCommanding();
  }
}

// The median of some steps: the overshoot of `improved` is at the edge of the band that settling is measured by, and on
// which side of it depends on the noise and on the phase between timers and samples.
TEST_F(StepResponse, BothReachTheSetPointAndImprovedSettlesFaster) {
  SimulatedRobot standard("standard/"), improved("improved/");
  const Steps slow = drive(standard, "standard");
  const Steps fast = drive(improved, "improved");
  const double slow_settling = Steps::median(slow.settling), fast_settling = Steps::median(fast.settling);
  EXPECT_LE(slow.largest_error_pct, plantBars().steady_error_pct);
  EXPECT_LE(fast.largest_error_pct, plantBars().steady_error_pct);
  EXPECT_LE(fast_settling, plantBars().settling * slow_settling);
  EXPECT_LE(Steps::median(fast.rise), 0.8 * Steps::median(slow.rise));
  RecordProperty("standard_settling_ms", static_cast<int>(1000 * slow_settling));
  RecordProperty("improved_settling_ms", static_cast<int>(1000 * fast_settling));
  ROS_INFO("settling: standard %.3f s, improved %.3f s", slow_settling, fast_settling);
}

}  // namespace
}  // namespace jackal_aic::test
