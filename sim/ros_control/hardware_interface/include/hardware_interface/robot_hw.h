#pragma once

/// @file
/// A robot as the controller manager sees it.

#include <ros/node_handle.h>

#include "hardware_interface/hardware_interface.h"
#include "hardware_interface/interface_resources.h"
#include "hardware_interface/internal/interface_manager.h"

namespace hardware_interface {

/// Interfaces to a robot; derived classes own the data behind their handles.
class RobotHW : public InterfaceManager {
 public:
  virtual ~RobotHW() = default;

  /// Set-up outside the realtime thread; false if it failed.
  virtual bool init(ros::NodeHandle& /*root_nh*/, ros::NodeHandle& /*robot_hw_nh*/) { return true; }

  /// Takes the state of the robot into the data behind the handles.
  virtual void read(const ros::Time& /*time*/, const ros::Duration& /*period*/) {}

  /// Gives the commands behind the handles to the robot.
  virtual void write(const ros::Time& /*time*/, const ros::Duration& /*period*/) {}
};

}  // namespace hardware_interface
