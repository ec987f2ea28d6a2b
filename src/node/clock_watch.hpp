#pragma once

/// @file
/// Tells of a clock that does not go.

#include <ros/ros.h>

#include <functional>

namespace jackal_aic {

/// Looks at the ROS clock twice a second of wall time, and tells once when it stands still for three seconds (or never
/// came: /use_sim_time without a simulation), and when it goes on.
class ClockWatch {
 public:
  /// @param look called with every look, before it.
  ClockWatch(const ros::NodeHandle& node, std::function<void()> look);

 private:
  void look();

  std::function<void()> before_;
  ros::Time last_;          // at the last look
  ros::WallTime advanced_;  // when the clock was seen to go on
  bool stands_ = false;     // and this was told
  ros::WallTimer timer_;
};

}  // namespace jackal_aic
