#pragma once

/// @file
/// Loads controllers from plugins and runs them on a robot.

#include <controller_interface/controller_base.h>
#include <controller_manager_msgs/ListControllers.h>
#include <controller_manager_msgs/LoadController.h>
#include <controller_manager_msgs/SwitchController.h>
#include <controller_manager_msgs/UnloadController.h>
#include <hardware_interface/robot_hw.h>
#include <ros/ros.h>

#include <atomic>
#include <list>
#include <mutex>
#include <pluginlib/class_loader.hpp>
#include <string>
#include <vector>

namespace controller_manager {

/// Serves controller_manager/{list,load,unload,switch}_controller(s) and runs the controllers in update(), which
/// belongs to another thread than the services; a switch waits until update() has made it. A controller's type is its
/// parameter `type`.
class ControllerManager {
 public:
  static constexpr bool WAIT_FOR_ALL_RESOURCES = false;
  static constexpr double INFINITE_TIMEOUT = 0.0;

  /// @param robot_hw has to outlive the manager; @param nh namespace of the services and of the controllers'
  /// parameters.
  explicit ControllerManager(hardware_interface::RobotHW* robot_hw, const ros::NodeHandle& nh = ros::NodeHandle());
  virtual ~ControllerManager() = default;

  /// Runs every controller that runs, and starts and stops what was asked for. @param reset_controllers restarts all.
  void update(const ros::Time& time, const ros::Duration& period, bool reset_controllers = false);

  /// Constructs and initialises the controller of this name. False, with a message, if it failed.
  bool loadController(const std::string& name);

  /// Destroys a controller that does not run.
  bool unloadController(const std::string& name);

  /// Starts and stops controllers in one update(). @param strictness controller_manager_msgs::SwitchController: with
  /// BEST_EFFORT names that cannot be started or stopped are left out; @param timeout for update() to come [s].
  bool switchController(const std::vector<std::string>& start_controllers,
                        const std::vector<std::string>& stop_controllers, int strictness,
                        bool start_asap = WAIT_FOR_ALL_RESOURCES, double timeout = INFINITE_TIMEOUT);

  /// nullptr if there is none of this name.
  virtual controller_interface::ControllerBase* getControllerByName(const std::string& name);

 private:
  struct Loaded {
    hardware_interface::ControllerInfo info;
    controller_interface::ControllerBaseSharedPtr controller;
  };

  bool choose(const std::vector<std::string>& names, bool running, bool strict, std::vector<Loaded*>& chosen);
  bool conflicts(const std::vector<Loaded*>& start, const std::vector<Loaded*>& stop) const;
  bool list(controller_manager_msgs::ListControllers::Request& request,
            controller_manager_msgs::ListControllers::Response& response);

  hardware_interface::RobotHW* robot_hw_;
  ros::NodeHandle root_nh_;
  pluginlib::ClassLoader<controller_interface::ControllerBase> loader_;
  std::mutex services_;  // one service at a time
  std::mutex lists_;     // held by update() too: a stand-in is no realtime system
  std::list<Loaded> loaded_;
  std::vector<Loaded*> start_, stop_;
  std::atomic<bool> switching_{false};
  std::vector<ros::ServiceServer> servers_;
};

}  // namespace controller_manager
