#pragma once

/// @file
/// A test's eyes and hands on the simulated robot: publishes set points on simulated time, records what the topics
/// carry with the stamps of the simulation, and waits for simulated time. Nothing here asserts on wall time.

#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <jackal_aic/ControllerState.h>
#include <jackal_aic/SensorGeneralized.h>
#include <jackal_msgs/Drive.h>
#include <nav_msgs/Odometry.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_msgs/Time.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "response_metrics.hpp"

namespace jackal_aic::test {

constexpr double kActionPeriod = 0.02;  ///< of the presets [s]

/// Velocity series of a run.
struct Recording {
  std::vector<double> time;      ///< [s]
  std::vector<double> forward;   ///< true x_dot in base_link [m/s]
  std::vector<double> yaw_rate;  ///< true theta_dot [rad/s]
};

/// Mean of a recorded series over (from, to] [s].
inline double mean(const Recording& done, const std::vector<double>& series, double from, double to) {
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (done.time[i] <= from || done.time[i] > to) continue;
    sum += series[i];
    ++count;
  }
  EXPECT_GT(count, 0) << "nothing recorded between " << from << " and " << to;
  return sum / count;
}

/// Talks to one controller and one plant.
class SimulatedRobot {
 public:
  /// @param prefix namespace of the controller, e.g. "" or "standard/".
  explicit SimulatedRobot(const std::string& prefix = "") {
    set_point_ = node_.advertise<geometry_msgs::Twist>(prefix + "jackal_AIC/set_point", 10);
    // Else the kernel holds small messages back for up to 40 ms of wall time, which are a tenth of a simulated second.
    const ros::TransportHints at_once = ros::TransportHints().tcpNoDelay();
    truth_subscriber_ = node_.subscribe("ground_truth/odom", 1000, &SimulatedRobot::onTruth, this, at_once);
    drive_subscriber_ = node_.subscribe(prefix + "cmd_drive", 1000, &SimulatedRobot::onDrive, this, at_once);
    state_subscriber_ = node_.subscribe(prefix + "jackal_AIC/state", 1000, &SimulatedRobot::onState, this, at_once);
    seen_ = node_.advertise<std_msgs::Time>("/plant/seen", 10);
    geometry_msgs::TransformStamped mount;  // of sim/urdf/jackal.urdf
    mount.header.frame_id = "base_link";
    mount.child_frame_id = "imu_link";
    mount.transform.rotation.w = 1.0;
    mounts_.sendTransform(mount);
  }

  /// Serves callbacks until a condition holds; fails the test if the simulation stands still for 60 s of wall time
  /// meanwhile.
  bool waitFor(const std::function<bool()>& condition, const std::string& what) {
    ros::WallTime progress = ros::WallTime::now();
    ros::Time last = ros::Time::now();
    while (ros::ok() && !condition()) {
      publishDueSetPoint();
      ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.002));
      publishSeen();
      if (ros::Time::now() != last) {
        last = ros::Time::now();
        if (patience_ > 0 && last.toSec() > patience_) break;
        progress = ros::WallTime::now();
      } else if (ros::WallTime::now() - progress > ros::WallDuration(60.0)) {
        break;
      }
    }
    const bool reached = condition();
    EXPECT_TRUE(reached) << "waited in vain for " << what << " at simulated time " << ros::Time::now();
    return reached;
  }

  /// As waitFor, for at most `longest` simulated seconds.
  bool waitFor(const std::function<bool()>& condition, const std::string& what, double longest) {
    patience_ = ros::Time::now().toSec() + longest;
    const bool reached = waitFor(condition, what);
    patience_ = 0.0;
    return reached;
  }

  /// Waits until clock, ground truth and controller speak and the set point has a subscriber.
  bool waitUntilReady() {
    return waitFor(
        [this] {
          return !ros::Time::now().isZero() && !truth_.time.empty() && !states_.empty() &&
                 set_point_.getNumSubscribers() > 0;
        },
        "clock, ground truth and controller state");
  }

  /// Lets simulated time pass [s]. Set points go on at 20 Hz unless they were stopped.
  void run(double seconds) {
    const ros::Time end = ros::Time::now() + ros::Duration(seconds);
    waitFor([end] { return ros::Time::now() >= end; }, "simulated time");
  }

  /// Commands a set point from now on, at 20 Hz of simulated time, the first time zero for a moment before: a
  /// controller that has just started waits for that. Returns the time of the first message [s].
  double command(double forward, double yaw_rate) {
    if (!std::exchange(commanded_, true)) {
      command(0.0, 0.0);
      run(0.2);
    }
    wanted_.linear.x = forward;
    wanted_.angular.z = yaw_rate;
    commanding_ = true;
    next_set_point_ = ros::Time(0);
    publishDueSetPoint();
    return ros::Time::now().toSec();
  }

  /// Sends no more set points.
  void stopCommanding() { commanding_ = false; }

  /// Leaves the set points to another node: the controller obeys one publisher only.
  void leaveSetPoint() {
    commanding_ = false;
    set_point_.shutdown();
  }

  /// Publishes one set point now, as it is.
  void publishOnce(const geometry_msgs::Twist& twist) { set_point_.publish(twist); }

  /// Commands zero until the robot stands still, then forgets the recording.
  void rest() {
    command(0.0, 0.0);
    run(2.0);
    clear();
  }

  /// Forgets everything recorded.
  void clear() {
    truth_ = {};
    states_.clear();
    drives_.clear();
  }

  /// The newest controller state; waits for one if there is none since everything was forgotten.
  ControllerState lastState() {
    waitFor([this] { return !states_.empty(); }, "a state of the controller");
    return states_.empty() ? ControllerState() : states_.back();
  }

  const Recording& truth() const { return truth_; }                          ///< true velocity
  const std::vector<ControllerState>& states() const { return states_; }     ///< controller states
  const std::vector<jackal_msgs::Drive>& drives() const { return drives_; }  ///< drive messages

  /// Figures of the forward step since `step_time` [s].
  sim::ResponseMetrics forwardStep(double step_time, double set_point) const {
    return sim::stepResponseMetrics(truth_.time, truth_.forward, step_time, 0.0, set_point);
  }

  /// Mean of a series of the truth over (from, to] [s].
  double mean(const std::vector<double>& series, double from, double to) const {
    return test::mean(truth_, series, from, to);
  }

  /// Largest change of a wheel command in one action period, over the recorded states [rad/s]. A late timer publishes
  /// once for several periods.
  double largestCommandStep() const {
    double largest = 0.0;
    for (std::size_t i = 1; i < states_.size(); ++i) {
      const auto &a = states_[i - 1], &b = states_[i];
      const double periods = std::max(1.0, std::round((b.header.stamp - a.header.stamp).toSec() / kActionPeriod));
      const double step =
          std::max(std::abs(b.command_left - a.command_left), std::abs(b.command_right - a.command_right));
      largest = std::max(largest, step / periods);
    }
    return largest;
  }

  /// First controller state stamped later than `time` [s] that satisfies a condition; nullptr if there is none.
  const ControllerState* firstState(double time, const std::function<bool(const ControllerState&)>& condition) const {
    for (const auto& state : states_) {
      if (state.header.stamp.toSec() > time && condition(state)) return &state;
    }
    return nullptr;
  }

 private:
  void onTruth(const nav_msgs::Odometry& message) {
    truth_.time.push_back(message.header.stamp.toSec());
    truth_.forward.push_back(message.twist.twist.linear.x);
    truth_.yaw_rate.push_back(message.twist.twist.angular.z);
  }
  void onDrive(const jackal_msgs::Drive& message) { drives_.push_back(message); }
  void onState(const ControllerState& message) { states_.push_back(message); }

  void publishDueSetPoint() {
    const ros::Time now = ros::Time::now();
    if (!commanding_ || (now < next_set_point_ && next_set_point_ - now < ros::Duration(1.0))) return;
    set_point_.publish(wanted_);
    next_set_point_ = now + ros::Duration(0.05);
  }

  /// Keeps the simulation from leaving this process behind on a busy machine.
  void publishSeen() {
    std_msgs::Time seen;
    seen.data = ros::Time::now();
    if (seen.data >= seen_time_ && seen.data - seen_time_ < ros::Duration(0.5 * kActionPeriod)) return;
    seen_time_ = seen.data;
    seen_.publish(seen);
  }

  ros::NodeHandle node_;
  ros::Publisher set_point_, seen_;
  tf2_ros::StaticTransformBroadcaster mounts_;
  ros::Subscriber truth_subscriber_, drive_subscriber_, state_subscriber_;
  geometry_msgs::Twist wanted_;
  bool commanding_ = false;
  bool commanded_ = false;  // ever
  ros::Time next_set_point_, seen_time_;
  double patience_ = 0.0;
  Recording truth_;
  std::vector<ControllerState> states_;
  std::vector<jackal_msgs::Drive> drives_;
};

}  // namespace jackal_aic::test
