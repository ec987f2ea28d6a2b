#pragma once

/// @file
/// Services by which a person holds a controller at rest, or has it start anew. The same for the node and for the
/// controller of ros_control.

#include <ros/node_handle.h>
#include <ros/service_server.h>
#include <ros/time.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <functional>

#include "jackal_aic/model/types.hpp"

namespace jackal_aic {

/// Serves in a namespace:
/// enable (std_srvs/SetBool): false brakes the robot and holds it at rest (StopCause::disabled), true lets it drive
/// again, by restart_after_stop; reset (std_srvs/Trigger): forgets motion and faults (not what was learned of the
/// robot, not what it reports, and not the pose of the odometry, which must not jump) while it rests and nobody asks it
/// to move.
class DriveServices {
 public:
  /// What the owner does.
  struct Actions {
    std::function<void(bool enabled)> enable;
    std::function<bool()> at_rest;  ///< resting() holds for the command
    std::function<void()> reset;
  };

  /// @param node the namespace; @param set_point_deadline time for which a set point counts [s]; 0: for ever.
  DriveServices(const ros::NodeHandle& node, double set_point_deadline, Actions actions);

  DriveServices(const DriveServices&) = delete;
  DriveServices& operator=(const DriveServices&) = delete;

  /// True for a command that keeps the robot where it is, but for what noise makes of it.
  static bool resting(const WheelCommand& command);

  /// A set point came just now.
  void noteSetPoint(const SetPoint& wanted);

 private:
  bool onEnable(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response);
  bool onReset(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);
  bool askedToMove() const;

  Actions actions_;
  double set_point_deadline_;
  SetPoint wanted_;
  ros::Time wanted_at_;
  ros::ServiceServer enable_service_;
  ros::ServiceServer reset_service_;
};

}  // namespace jackal_aic
