// The predictive controller on the ROS path (nodes, topics, timers): as fast as open loop and as exact as without ROS,
// with a belief that tells the truth. The test's parameter ~plant is "ground" or "box".

#include <dynamic_reconfigure/Reconfigure.h>
#include <geometry_msgs/TwistWithCovarianceStamped.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "../closed_loop/step_response.hpp"
#include "service_call.hpp"
#include "simulated_robot.hpp"
#include "true_motion.hpp"

namespace jackal_aic::test {
namespace {

constexpr double kSpeed = 0.5;          // m/s
constexpr double kTurn = 0.5;           // rad/s
constexpr double kTransport = 0.01;     // s; commands and measurements take a few ms from node to node
constexpr double kSensorPeriod = 0.02;  // s; on the box the truth comes at the rate of the encoders

/// The same run in the closed loop without ROS.
sim::ResponseMetrics offline(const std::string& controller, double forward, double yaw_rate) {
  const sim::PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  sim::Overrides overrides;
  if (onBox()) overrides.push_back({"plant.noise_scale", "0"});
  const auto setup = sim::loadSetup(files, controller, onBox() ? "box" : "ground", overrides);
  return sim::runSetup(setup, sim::stepProfile(forward, yaw_rate, 4.0)).metrics;
}

/// A recorded series at a time between its samples.
double at(const Recording& done, const std::vector<double>& series, double time) {
  const auto next = std::upper_bound(done.time.begin(), done.time.end(), time) - done.time.begin();
  const double part = (time - done.time[next - 1]) / (done.time[next] - done.time[next - 1]);
  return series[next - 1] + part * (series[next] - series[next - 1]);
}

class PredictivePath : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(robot.waitUntilReady());
    ASSERT_TRUE(robot.waitFor([this] { return truth.any(); }, "wheel speeds"));
    robot.rest();
  }

  void TearDown() override { robot.stopCommanding(); }

  /// Drives a step from rest. It begins with the first action that follows the set point, which a set point from
  /// another node waits for by up to a period; without ROS both come together.
  sim::ResponseMetrics drive(double forward, double yaw_rate) {
    robot.clear();
    const double sent = robot.command(forward, yaw_rate);
    robot.run(4.0);
    const ControllerState* first = robot.firstState(sent, [&](const ControllerState& state) {
      return state.set_point_forward == forward && state.set_point_yaw_rate == yaw_rate;
    });
    EXPECT_NE(first, nullptr) << "the set point was not followed";
    const double start = first ? first->header.stamp.toSec() : sent;
    const Recording& done = truth.of(robot);
    return sim::stepResponseMetrics(done.time, forward != 0.0 ? done.forward : done.yaw_rate, start, 0.0,
                                    forward != 0.0 ? forward : yaw_rate);
  }

  /// Compares with the closed loop without ROS: predictive as it is there, and the bar against open loop.
  void expectAsOffline(const sim::ResponseMetrics& path, double forward, double yaw_rate) {
    const auto same = offline("predictive", forward, yaw_rate);
    const auto open_loop = offline("diff_drive", forward, yaw_rate);
    ASSERT_TRUE(path.bounded && path.settling && path.rise && same.settling && open_loop.settling);
    ROS_INFO(
        "settling %.3f s on the ROS path, %.3f s without, %.3f s open loop; overshoot %.2f %%, %.2f %%; steady-state "
        "error %.2f %%, %.2f %%",
        *path.settling, *same.settling, *open_loop.settling, path.overshoot_pct, same.overshoot_pct,
        path.steady_error_pct, same.steady_error_pct);
    const double resolution = kTransport + (onBox() ? kSensorPeriod : 0.0);
    EXPECT_LE(*path.settling, 1.10 * *open_loop.settling + resolution);
    EXPECT_NEAR(*path.settling, *same.settling, 0.1 * *same.settling + resolution);
  }

  SimulatedRobot robot;
  Truth truth;
};

TEST_F(PredictivePath, StepIsAsFastAsOpenLoopAndExact) {
  const auto metrics = drive(kSpeed, 0.0);
  expectAsOffline(metrics, kSpeed, 0.0);
  EXPECT_LE(metrics.overshoot_pct, 5.0);
  EXPECT_NEAR(metrics.steady_error_pct, 0.0, 0.5);
}

TEST_F(PredictivePath, TurnIsAsFastAsOpenLoopAndExact) {
  for (double sign : {1.0, -1.0}) {
    robot.rest();
    const auto metrics = drive(0.0, sign * kTurn);
    expectAsOffline(metrics, 0.0, sign * kTurn);
    EXPECT_NEAR(metrics.steady_error_pct, 0.0, 2.0);
  }
}

TEST_F(PredictivePath, BeliefTellsWhatTheRobotDoes) {
  std::vector<geometry_msgs::TwistWithCovarianceStamped> beliefs;
  ros::NodeHandle node;
  const auto subscriber = node.subscribe<geometry_msgs::TwistWithCovarianceStamped>(
      "jackal_AIC/belief", 1000,
      [&](const geometry_msgs::TwistWithCovarianceStampedConstPtr& message) { beliefs.push_back(*message); });
  robot.waitFor([&] { return subscriber.getNumPublishers() > 0; }, "a publisher of the belief");
  const double start = robot.command(kSpeed, onBox() ? 0.0 : kTurn);
  robot.run(3.0);
  const Recording& done = truth.of(robot);
  double forward = 0.0, yaw = 0.0;
  int count = 0;
  for (const auto& belief : beliefs) {
    const double stamp = belief.header.stamp.toSec();
    if (stamp < start || stamp >= done.time.back()) continue;
    forward += std::pow(belief.twist.twist.linear.x - at(done, done.forward, stamp), 2);
    yaw += std::pow(belief.twist.twist.angular.z - at(done, done.yaw_rate, stamp), 2);
    ++count;
    ASSERT_GT(belief.twist.covariance[0], 0.0);
    ASSERT_GT(belief.twist.covariance[35], 0.0);
    ASSERT_EQ(belief.header.frame_id, "base_link");
  }
  ASSERT_GT(count, 100);
  const double forward_rms = std::sqrt(forward / count), yaw_rms = std::sqrt(yaw / count);
  ROS_INFO("belief against ground truth: %.4f m/s, %.4f rad/s RMS", forward_rms, yaw_rms);
  EXPECT_LT(forward_rms, 0.03 * kSpeed);
  EXPECT_LT(yaw_rms, onBox() ? 0.01 : 0.1 * kTurn) << "with the effective track still to be learned";
}

/// Asks the running controller for a gain, or a variance of the sensors; returns what it answers with.
double request(const std::string& name, double value, const std::string& section = "predictive") {
  dynamic_reconfigure::Reconfigure call;
  dynamic_reconfigure::DoubleParameter wanted;
  wanted.name = name;
  wanted.value = value;
  call.request.config.doubles.push_back(wanted);
  EXPECT_TRUE(sim::callService("/controller/" + section + "/set_parameters", call));
  for (const auto& answer : call.response.config.doubles) {
    if (answer.name == name) return answer.value;
  }
  ADD_FAILURE() << "no gain " << name;
  return 0.0;
}

TEST_F(PredictivePath, GainsChangeWhileItDrivesAndUnstableOnesAreRefused) {
  robot.command(kSpeed, 0.0);
  robot.run(2.0);
  robot.clear();
  EXPECT_EQ(request("reference_time", 0.2), 0.2);
  EXPECT_EQ(request("action_learning_rate", 0.0), 1.0) << "unstable: the running one stays";
  robot.run(1.0);
  double slowest = kSpeed, fastest = kSpeed;
  const Recording& done = truth.of(robot);
  for (std::size_t i = 0; i < done.time.size(); ++i) {
    if (done.time[i] < robot.states().front().header.stamp.toSec()) continue;
    slowest = std::min(slowest, done.forward[i]);
    fastest = std::max(fastest, done.forward[i]);
  }
  EXPECT_GT(slowest, 0.97 * kSpeed) << "without a jump";
  EXPECT_LT(fastest, 1.03 * kSpeed) << "without a jump";
  EXPECT_EQ(request("reference_time", 0.01), 0.01);
}

// The published covariance follows the innovations, which on the ground make up for a wrong variance: there the free
// energy tells which one is configured. Without noise, on the box, there are hardly any innovations.
TEST_F(PredictivePath, SensorVariancesChangeWhileItDrivesAndOutliveOtherGains) {
  double variance = 0.0;  // of the believed forward speed, the least; a command that is a moment late adds to it
  ros::NodeHandle node;
  const auto subscriber = node.subscribe<geometry_msgs::TwistWithCovarianceStamped>(
      "jackal_AIC/belief", 10, [&](const geometry_msgs::TwistWithCovarianceStampedConstPtr& message) {
        variance = std::min(variance, message->twist.covariance[0]);
      });
  const auto distrust = [&] {  // of the wheels; grows with their variance
    robot.clear();
    robot.run(2.0);
    variance = std::numeric_limits<double>::infinity();
    robot.run(2.0);
    double free_energy = 0.0;
    for (const ControllerState& state : robot.states()) free_energy += state.free_energy;
    EXPECT_GT(robot.states().size(), 50u);
    return onBox() ? variance : static_cast<double>(robot.states().size()) / free_energy;
  };
  robot.command(kSpeed, 0.0);
  robot.run(1.0);
  const double configured = distrust();
  EXPECT_EQ(request("wheel_variance", 9e-3, "sensors"), 9e-3);
  EXPECT_GT(distrust(), 1.5 * configured) << "of wheels that are trusted less";
  EXPECT_EQ(request("reference_time", 0.02), 0.02);
  EXPECT_GT(distrust(), 1.5 * configured);
  EXPECT_EQ(request("reference_time", 0.01), 0.01);
  EXPECT_EQ(request("wheel_variance", 9e-4, "sensors"), 9e-4);
  EXPECT_LT(distrust(), 1.3 * configured);
}

}  // namespace
}  // namespace jackal_aic::test
