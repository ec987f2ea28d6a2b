#include "robot_watch.hpp"

#include <jackal_msgs/Drive.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "conversions.hpp"

namespace jackal_aic {
namespace {

/// Wheel speed above which a wheel counts as moving [rad/s], 0.05 m/s: its position then changes with every sample.
constexpr double kMoving = 0.5;

}  // namespace

RobotWatch::RobotWatch(ros::NodeHandle& node, const RobotNames& names, const DeadlineParameters& deadlines,
                       std::function<ros::Time()> now)
    : names_(names), now_(std::move(now)), wheels_(deadlines.frozen_wheels), imu_(deadlines.frozen_imu) {
  const auto no_delay = ros::TransportHints().tcpNoDelay();
  emergency_stop_subscriber_ = node.subscribe("e_stop", 10, &RobotWatch::onEmergencyStop, this, no_delay);
  status_subscriber_ = node.subscribe("status", 10, &RobotWatch::onStatus, this, no_delay);
  feedback_subscriber_ = node.subscribe("feedback", 50, &RobotWatch::onFeedback, this, no_delay);
}

void RobotWatch::addWheels(const sensor_msgs::JointState& message, const ros::Time& now, const WheelCommand& command) {
  const auto left = meanVelocity(message, names_.left_wheel_joints);
  const auto right = meanVelocity(message, names_.right_wheel_joints);
  if (!left || !right) return;  // a message about other joints
  wheel_speeds_ = {*left, *right};
  const double speed = std::max({std::abs(*left), std::abs(*right), std::abs(command.left), std::abs(command.right)});
  FrozenSource::Sample sample = FrozenSource::Sample::Zero();
  sample.head<4>() << *left, *right, sumOfPositions(message, names_.left_wheel_joints),
      sumOfPositions(message, names_.right_wheel_joints);
  wheels_.update(now.toSec(), sample, speed < kMoving);
}

void RobotWatch::addImu(const sensor_msgs::Imu& message, const ros::Time& now) {
  const auto& w = message.angular_velocity;
  const auto& a = message.linear_acceleration;
  FrozenSource::Sample sample = FrozenSource::Sample::Zero();
  sample.head<6>() << w.x, w.y, w.z, a.x, a.y, a.z;
  imu_.update(now.toSec(), sample, false);
}

void RobotWatch::addCauses(StopCauses& causes) const {
  causes.add(StopCause::wheels_frozen, wheels_.frozen())
      .add(StopCause::imu_frozen, imu_.frozen())
      .add(StopCause::motors_off, motors_off_)
      .add(StopCause::robot_stopped, robot_stopped_)
      .add(StopCause::emergency_stop, emergency_stop_)
      .add(StopCause::driver_fault, driver_fault_);
}

void RobotWatch::reset() {
  wheels_.reset();
  imu_.reset();
  feedback_arrival_ = {};
  motors_off_ = driver_fault_ = false;
}

void RobotWatch::onStatus(const jackal_msgs::Status& message) {
  const bool stopped = message.driver_external_stop_present && message.driver_external_stop_stopped;
  robot_stopped_ = stopped || !message.drivers_active;
}

void RobotWatch::onFeedback(const jackal_msgs::Feedback& message) {
  if (message.header.stamp.isZero()) return;
  feedback_arrival_ = {message.header.stamp, now_()};
  motors_off_ = message.commanded_mode == jackal_msgs::Drive::MODE_VELOCITY &&
                message.actual_mode != jackal_msgs::Drive::MODE_VELOCITY;
  driver_fault_ = message.drivers[0].driver_fault || message.drivers[1].driver_fault;
}

}  // namespace jackal_aic
