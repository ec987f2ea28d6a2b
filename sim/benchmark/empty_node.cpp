// What controller_node costs at the least: its timers, subscriptions and publications, and nothing in them.

#include <geometry_msgs/Twist.h>
#include <jackal_aic/ControllerState.h>
#include <jackal_aic/SensorGeneralized.h>
#include <jackal_msgs/Drive.h>
#include <jackal_msgs/Feedback.h>
#include <jackal_msgs/Status.h>
#include <nav_msgs/Odometry.h>
#include <ros/ros.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Bool.h>

#include <algorithm>
#include <cstdio>
#include <string>

namespace {

constexpr const char* kHelp =
    "Usage: rosrun jackal_aic empty_node\n"
    "A roscpp node with the timers (1 kHz, 50 Hz), subscriptions and publications of controller_node, with which it "
    "takes\n"
    "and publishes messages of the same types and rates and does nothing else: what the controller's CPU time is "
    "compared\n"
    "with. Needs a ROS master.\n";

/// Arrays as long as with p = 3.
constexpr std::size_t kOrders = 4;

}  // namespace

int main(int argc, char** argv) {
  if (std::any_of(argv, argv + argc, [](const std::string& w) { return w == "--help" || w == "-h"; })) {
    return std::fputs(kHelp, stdout) < 0;
  }
  ros::init(argc, argv, "empty_node");
  ros::NodeHandle node;
  ros::Publisher drive = node.advertise<jackal_msgs::Drive>("cmd_drive", 1);
  ros::Publisher state = node.advertise<jackal_aic::ControllerState>("jackal_AIC/state", 10);
  ros::Publisher sensor = node.advertise<jackal_aic::SensorGeneralized>("sensor_generalized", 10);
  ros::Publisher odom = node.advertise<nav_msgs::Odometry>("odom", 10);
  const auto no_delay = ros::TransportHints().tcpNoDelay();
  const auto take = [](const auto&) {};
  const ros::Subscriber subscribers[] = {
      node.subscribe<geometry_msgs::Twist>("jackal_AIC/set_point", 10, take, {}, no_delay),
      node.subscribe<sensor_msgs::JointState>("joint_states", 50, take, {}, no_delay),
      node.subscribe<std_msgs::Bool>("e_stop", 10, take, {}, no_delay),
      node.subscribe<jackal_msgs::Status>("status", 10, take, {}, no_delay),
      node.subscribe<jackal_msgs::Feedback>("feedback", 50, take, {}, no_delay),
      node.subscribe<sensor_msgs::Imu>(
          "imu/data", 50,
          [&](const sensor_msgs::ImuConstPtr& message) {
            jackal_aic::SensorGeneralized y;
            y.header = message->header;
            for (auto* channel : {&y.yaw_rate, &y.wheel_left, &y.wheel_right, &y.acceleration_x, &y.acceleration_y}) {
              channel->resize(kOrders);
            }
            sensor.publish(y);
          },
          {}, no_delay)};
  static_cast<void>(subscribers);
  const ros::Timer belief = node.createTimer(ros::Duration(0.001), [](const ros::TimerEvent&) {});
  const ros::Timer action = node.createTimer(ros::Duration(0.02), [&](const ros::TimerEvent&) {
    const ros::Time now = ros::Time::now();
    drive.publish(jackal_msgs::Drive());
    jackal_aic::ControllerState s;
    s.header.stamp = now;
    for (auto* array : {&s.belief_forward, &s.belief_lateral, &s.belief_yaw_rate, &s.state_error_forward,
                        &s.state_error_lateral, &s.state_error_yaw_rate, &s.sensory_error_yaw_rate,
                        &s.sensory_error_wheel_left, &s.sensory_error_wheel_right}) {
      array->resize(kOrders);
    }
    state.publish(s);
    nav_msgs::Odometry o;
    o.header.stamp = now;
    odom.publish(o);
  });
  ros::spin();
  return 0;
}
