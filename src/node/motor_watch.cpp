#include "motor_watch.hpp"

#include <cmath>
#include <utility>

#include "conversions.hpp"

namespace jackal_aic {
namespace {

/// How far, relative, measured wheel speeds of ours may be from what we sent.
constexpr double kGainTolerance = 0.3;

}  // namespace

MotorWatch::MotorWatch(ros::NodeHandle& node, OutputMode mode, const GeometryParameters& geometry,
                       std::function<ros::Time()> now)
    : shared_(mode == OutputMode::twist), kinematics_(geometry), now_(std::move(now)) {
  if (!shared_) return;
  const auto no_delay = ros::TransportHints().tcpNoDelay();
  drive_subscriber_ = node.subscribe("cmd_drive", 10, &MotorWatch::onDrive, this, no_delay);
  twist_subscriber_ = node.subscribe("jackal_velocity_controller/cmd_vel", 10, &MotorWatch::onTwist, this, no_delay);
}

std::vector<std::string> MotorWatch::topics() const {
  if (!shared_) return {};
  return {drive_subscriber_.getTopic(), twist_subscriber_.getTopic()};
}

void MotorWatch::onDrive(const jackal_msgs::Drive& message) {
  const bool velocity = message.mode == jackal_msgs::Drive::MODE_VELOCITY;
  const WheelCommand command{velocity ? message.drivers[jackal_msgs::Drive::LEFT] : 0.0,
                             velocity ? message.drivers[jackal_msgs::Drive::RIGHT] : 0.0};
  if (!command.vector().allFinite()) return;
  any_drive_ = true;
  share_.apply(now_().toSec(), command);
}

void MotorWatch::onTwist(const geometry_msgs::Twist& message) {
  const auto velocity = setPoint(message);
  if (!velocity || any_drive_) return;
  any_twist_ = true;
  share_.apply(now_().toSec(), kinematics_.wheelSpeeds(velocity->forward, velocity->yaw_rate));
}

void MotorWatch::addWheels(double now, const WheelCommand& speeds) {
  if (shared_ && !any_drive_ && !any_twist_) share_.apply(now, speeds, kGainTolerance);
}

void MotorWatch::noteSilence(double now) {
  if (any_twist_ && !any_drive_ && !share_.known(now)) share_.apply(now, {});
}

void MotorWatch::send(double now, const WheelCommand& command) {
  if (shared_) share_.send(now, command);
}

std::optional<WheelCommand> MotorWatch::applied(double now) {
  noteSilence(now);
  return share_.known(now) ? std::optional(share_.applied()) : std::nullopt;
}

std::optional<WheelCommand> MotorWatch::another(double now) {
  const auto command = applied(now);
  return share_.ours(now) ? std::nullopt : command;
}

void MotorWatch::reset() {
  share_.reset();
  any_drive_ = any_twist_ = false;
}

}  // namespace jackal_aic
