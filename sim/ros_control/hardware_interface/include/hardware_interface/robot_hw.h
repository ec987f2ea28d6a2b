#pragma once

/// @file
/// A robot as the controller manager sees it.

#include <ros/node_handle.h>

#include <list>
#include <map>
#include <memory>
#include <string>

#include "hardware_interface/controller_info.h"
#include "hardware_interface/hardware_interface.h"
#include "hardware_interface/internal/interface_manager.h"

namespace hardware_interface {

/// Interfaces to a robot; derived classes own the data behind their handles.
class RobotHW : public InterfaceManager {
 public:
  /// State of a change of controllers.
  enum class SwitchState { DONE, ONGOING, ERROR };

  virtual ~RobotHW() = default;

  /// Set-up outside the realtime thread; false if it failed.
  virtual bool init(ros::NodeHandle& /*root_nh*/, ros::NodeHandle& /*robot_hw_nh*/) { return true; }

  /// True if two of the controllers claim the same resource.
  virtual bool checkForConflict(const std::list<ControllerInfo>& info) const {
    std::map<std::string, std::string> owners;
    bool conflict = false;
    for (const ControllerInfo& controller : info) {
      for (const InterfaceResources& claimed : controller.claimed_resources) {
        for (const std::string& resource : claimed.resources) {
          const auto [owner, first] = owners.emplace(resource, controller.name);
          if (first) continue;
          ROS_WARN("Resource conflict on [%s]. Controllers = [%s, %s]", resource.c_str(), owner->second.c_str(),
                   controller.name.c_str());
          conflict = true;
        }
      }
    }
    return conflict;
  }

  virtual bool prepareSwitch(const std::list<ControllerInfo>& /*start_list*/,
                             const std::list<ControllerInfo>& /*stop_list*/) {
    return true;
  }
  virtual void doSwitch(const std::list<ControllerInfo>& /*start_list*/,
                        const std::list<ControllerInfo>& /*stop_list*/) {}
  virtual SwitchState switchResult() const { return SwitchState::DONE; }
  virtual SwitchState switchResult(const ControllerInfo& /*controller*/) const { return SwitchState::DONE; }

  /// Takes the state of the robot into the data behind the handles.
  virtual void read(const ros::Time& /*time*/, const ros::Duration& /*period*/) {}

  /// Gives the commands behind the handles to the robot.
  virtual void write(const ros::Time& /*time*/, const ros::Duration& /*period*/) {}
};

using RobotHWSharedPtr = std::shared_ptr<RobotHW>;

}  // namespace hardware_interface
