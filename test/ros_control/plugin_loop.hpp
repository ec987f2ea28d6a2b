#pragma once

/// @file
/// Loads controllers as plugins and runs them, in one thread.

#include <controller_interface/controller_base.h>
#include <hardware_interface/robot_hw.h>
#include <ros/ros.h>

#include <exception>
#include <map>
#include <memory>
#include <pluginlib/class_loader.hpp>
#include <string>
#include <vector>

namespace jackal_aic::test {

/// The controllers of a robot. A controller's type is its parameter `type`.
class PluginLoop {
 public:
  using Controller = controller_interface::ControllerBase;

  /// A loaded controller and the resources that it claims.
  struct Loaded {
    std::unique_ptr<Controller> controller;
    Controller::ClaimedResources claimed;
  };

  /// @param robot has to outlive this.
  explicit PluginLoop(hardware_interface::RobotHW* robot)
      : robot_(robot), loader_("controller_interface", "controller_interface::ControllerBase") {}

  /// Constructs and initialises the controller of this name. False, with a message, if it failed.
  bool load(const std::string& name) {
    try {
      ros::NodeHandle root, node(name);
      Loaded loaded;
      loaded.controller.reset(loader_.createUnmanagedInstance(node.param<std::string>("type", "")));
      if (!loaded.controller->initRequest(robot_, root, node, loaded.claimed)) return false;
      loaded_[name] = std::move(loaded);
      return true;
    } catch (const std::exception& error) {
      ROS_ERROR("Could not load controller '%s': %s", name.c_str(), error.what());
      return false;
    }
  }

  /// Stops and starts controllers. False if one does not change.
  bool change(const std::vector<std::string>& started, const std::vector<std::string>& stopped) {
    bool changed = true;
    for (const std::string& name : stopped) changed &= at(name).controller->stopRequest(ros::Time::now());
    for (const std::string& name : started) changed &= at(name).controller->startRequest(ros::Time::now());
    return changed;
  }

  /// update() of every controller that runs.
  void update(const ros::Time& time, const ros::Duration& period) {
    for (auto& named : loaded_) named.second.controller->updateRequest(time, period);
  }

  /// @throws std::out_of_range if no controller has this name.
  Loaded& at(const std::string& name) { return loaded_.at(name); }

 private:
  hardware_interface::RobotHW* robot_;
  pluginlib::ClassLoader<Controller> loader_;
  std::map<std::string, Loaded> loaded_;  // destroyed before loader_, which holds its code
};

}  // namespace jackal_aic::test
