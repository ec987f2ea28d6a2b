#include "wheel_watchdog.hpp"

#include <ros/console.h>
#include <ros/this_node.h>
#include <ros/time.h>

#include <algorithm>

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;  // s of wall time between looks, and between zeros

double currentTime() { return ros::Time::isSimTime() ? ros::Time::now().toSec() : ros::SteadyTime::now().toSec(); }

}  // namespace

WheelWatchdog::WheelWatchdog(ros::NodeHandle& node, const WheelWatchdogParameters& parameters)
    : timeout_(parameters.timeout) {
  listen(node, wheels_[0], "jackal_left_wheel/command");
  listen(node, wheels_[1], "jackal_right_wheel/command");
  timer_ = node.createWallTimer(ros::WallDuration(kPeriod), [this](const ros::WallTimerEvent&) { onTimer(); });
}

void WheelWatchdog::listen(ros::NodeHandle& node, Wheel& wheel, const std::string& topic) {
  wheel.publisher = node.advertise<std_msgs::Float64>(topic, 1);
  const boost::function<void(const ros::MessageEvent<std_msgs::Float64 const>&)> callback =
      [this, &wheel](const ros::MessageEvent<std_msgs::Float64 const>& event) { onCommand(wheel, event); };
  wheel.subscriber =
      node.subscribe<std_msgs::Float64>(topic, 1, callback, ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
}

void WheelWatchdog::onCommand(Wheel& wheel, const ros::MessageEvent<std_msgs::Float64 const>& event) {
  if (event.getPublisherName() == ros::this_node::getName()) return;
  wheel.received = currentTime();
  wheel.any = true;
  wheel.at_rest = event.getMessage()->data == 0.0;
}

void WheelWatchdog::onTimer() {
  const double now = currentTime();
  for (Wheel& wheel : wheels_) {
    const double silence = now - wheel.received;
    // Before zero: the clock of a simulation jumped back.
    if (wheel.any && !(silence >= 0.0 && silence <= timeout_)) stop(wheel);
  }
}

void WheelWatchdog::stop(Wheel& wheel) {
  if (!wheel.at_rest) {
    ROS_WARN("No command on %s for %.2f s: the wheel is stopped", wheel.publisher.getTopic().c_str(), timeout_);
  }
  wheel.at_rest = true;
  wheel.publisher.publish(std_msgs::Float64());
}

void WheelWatchdog::stop() {
  for (Wheel& wheel : wheels_) wheel.publisher.publish(std_msgs::Float64());
}

bool WheelWatchdog::atRest() const {
  return std::all_of(wheels_.begin(), wheels_.end(), [](const Wheel& wheel) { return wheel.at_rest; });
}

}  // namespace jackal_aic
