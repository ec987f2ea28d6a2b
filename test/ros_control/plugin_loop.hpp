#pragma once

/// @file
/// Loads a controller as a plugin and runs it, in one thread.

#include <controller_interface/controller_base.h>
#include <hardware_interface/robot_hw.h>
#include <ros/ros.h>

#include <exception>
#include <memory>
#include <pluginlib/class_loader.hpp>
#include <string>

namespace jackal_aic::test {

/// One controller of a robot. Its type is its parameter `type`.
class PluginLoop {
 public:
  using Controller = controller_interface::ControllerBase;

  /// @param robot has to outlive this.
  explicit PluginLoop(hardware_interface::RobotHW* robot)
      : robot_(robot), loader_("controller_interface", "controller_interface::ControllerBase") {}

  /// Constructs and initialises the controller of this name in place of the one before. False, with a message, if it
  /// failed. @param remappings of the topics of the robot.
  bool load(const std::string& name, const ros::M_string& remappings = {}) {
    try {
      ros::NodeHandle root("", remappings), node(name);
      controller_.reset(loader_.createUnmanagedInstance(node.param<std::string>("type", "")));
      return controller_->initRequest(robot_, root, node, claimed_);
    } catch (const std::exception& error) {
      ROS_ERROR("Could not load controller '%s': %s", name.c_str(), error.what());
      return false;
    }
  }

  Controller* operator->() { return controller_.get(); }                    ///< the controller
  const Controller::ClaimedResources& claimed() const { return claimed_; }  ///< by the controller

 private:
  hardware_interface::RobotHW* robot_;
  pluginlib::ClassLoader<Controller> loader_;
  Controller::ClaimedResources claimed_;
  std::unique_ptr<Controller> controller_;  // destroyed before loader_, which holds its code
};

}  // namespace jackal_aic::test
