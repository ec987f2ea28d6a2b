#pragma once

/// @file
/// Stops wheels whose commands stay away, where nothing behind the topics does: with `output: gazebo` the wheel
/// controllers, and on a robot the stock jackal_node, repeat the last speed for ever when our process dies or hangs.

#include <ros/message_event.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/subscriber.h>
#include <ros/timer.h>
#include <std_msgs/Float64.h>

#include <array>
#include <string>

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic {

/// Parameters of the wheel watchdog, without prefix.
struct WheelWatchdogParameters {
  double timeout = 0.25;  ///< time without a command after which a wheel is stopped [s]
};

/// Lists the fields of WheelWatchdogParameters with unit and range.
template <class Visitor>
void describeFields(Visitor& v, WheelWatchdogParameters& p) {
  v.field("timeout", p.timeout, {0.05, 10.0}, "s", Presence::optional);
}

/// Name of the watchdog that belongs to a controller node: its publishing is no contention with the controller.
inline std::string watchdogOf(const std::string& controller) { return controller + "_watchdog"; }

/// Listens to jackal_left_wheel/command and jackal_right_wheel/command (std_msgs/Float64) and publishes zero on the one
/// whose commands stay away for longer than the timeout, until they come again. Silent before the first command. The
/// time is a steady one of the machine, so that a clock that is set does not matter, or /clock in a simulation, which
/// may stand still or run slowly.
class WheelWatchdog {
 public:
  WheelWatchdog(ros::NodeHandle& node, const WheelWatchdogParameters& parameters);

  /// True if the last command of each wheel was zero, whosever it was.
  bool atRest() const;

  /// Publishes zero for both wheels.
  void stop();

 private:
  struct Wheel {
    ros::Publisher publisher;
    ros::Subscriber subscriber;
    double received = 0.0;  // time of the last command that was not our own [s]
    bool any = false;       // whether there was one
    bool at_rest = true;    // the last command, our own included, was zero
  };

  void listen(ros::NodeHandle& node, Wheel& wheel, const std::string& topic);
  void onCommand(Wheel& wheel, const ros::MessageEvent<std_msgs::Float64 const>& event);
  void onTimer();
  void stop(Wheel& wheel);

  double timeout_;
  std::array<Wheel, 2> wheels_;
  ros::WallTimer timer_;
};

}  // namespace jackal_aic
