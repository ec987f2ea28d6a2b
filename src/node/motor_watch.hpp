#pragma once

/// @file
/// What reaches the motors, where twist_mux decides whose commands do.

#include <geometry_msgs/Twist.h>
#include <jackal_msgs/Drive.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "jackal_aic/motor_share.hpp"
#include "jackal_aic/skid_steer_kinematics.hpp"
#include "jackal_aic/types.hpp"
#include "node_parameters.hpp"

namespace jackal_aic {

/// With `output: twist`, listens to cmd_drive (jackal_msgs/Drive), which the stock jackal_node publishes without pause,
/// or, where there is none as in Gazebo, to jackal_velocity_controller/cmd_vel (geometry_msgs/Twist), what twist_mux
/// lets through; silence there is a stop, as for the stock velocity controller. Where nobody tells, the wheels do: what
/// they are measured to turn is taken for what they are commanded, and so no wheel can be blamed for it. In the other
/// output modes nobody else may drive, and everything is ours.
class MotorWatch {
 public:
  /// @param now the node's view of the time.
  MotorWatch(ros::NodeHandle& node, OutputMode mode, const GeometryParameters& geometry,
             std::function<ros::Time()> now);

  /// True in the output mode in which somebody else may drive.
  bool shared() const { return shared_; }

  /// Topics that it listens to: a set point that came from there would be our own command.
  std::vector<std::string> topics() const;

  /// A command of ours leaves. @param now [s].
  void send(double now, const WheelCommand& command);

  /// Measured wheel speeds [rad/s]. @param now [s].
  void addWheels(double now, const WheelCommand& speeds);

  /// What the motors have; empty if nobody tells. @param now [s].
  std::optional<WheelCommand> applied(double now);

  /// What the motors have instead of our command; empty if they have ours. @param now [s].
  std::optional<WheelCommand> another(double now);

  /// What to send meanwhile. @param goal wheel speeds that we want [rad/s].
  WheelCommand offer(const WheelCommand& goal) const { return share_.offer(goal); }

  /// Forgets the commands.
  void reset();

 private:
  void onDrive(const jackal_msgs::Drive& message);
  void onTwist(const geometry_msgs::Twist& message);
  void noteSilence(double now);

  bool shared_;
  SkidSteerKinematics kinematics_;
  std::function<ros::Time()> now_;
  MotorShare share_;
  bool any_drive_ = false;  // there was a cmd_drive: what twist_mux says does not matter
  bool any_twist_ = false;
  ros::Subscriber drive_subscriber_;
  ros::Subscriber twist_subscriber_;
};

}  // namespace jackal_aic
