#pragma once

/// @file
/// Services by which a person holds a controller at rest, or restarts it. The same for the node and for the
/// controller of ros_control.

#include <ros/node_handle.h>
#include <ros/service_server.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <functional>

#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Serves in a namespace:
/// enable (std_srvs/SetBool): false brakes the robot and holds it at rest (StopCause::disabled), true lets it drive
/// again, by restart_after_stop; reset (std_srvs/Trigger): restarts a robot at rest (DriveLoop::start()), which
/// forgets motion and faults, not what was learned of the robot, not what it reports, and not the pose of the odometry.
class DriveServices {
 public:
  /// What the owner does.
  struct Actions {
    std::function<void(bool enabled)> enable;
    std::function<bool()> at_rest;  ///< resting() holds for the command
    std::function<void()> reset;
  };

  /// @param node the namespace.
  DriveServices(const ros::NodeHandle& node, Actions actions);

  DriveServices(const DriveServices&) = delete;
  DriveServices& operator=(const DriveServices&) = delete;

  /// True for a command that keeps the robot where it is, but for what noise makes of it.
  static bool resting(const WheelCommand& command);

 private:
  bool onEnable(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response);
  bool onReset(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);

  Actions actions_;
  ros::ServiceServer enable_service_;
  ros::ServiceServer reset_service_;
};

}  // namespace jackal_aic
