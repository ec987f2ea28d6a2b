#pragma once

/// @file
/// A controller as the controller manager runs it.

#include <hardware_interface/robot_hw.h>
#include <ros/node_handle.h>

#include <vector>

namespace controller_interface {

/// Life of a controller: constructed, initialised once, then started and stopped any number of times. starting(),
/// update() and stopping() are called in the realtime thread.
class ControllerBase {
 public:
  using ClaimedResources = std::vector<hardware_interface::InterfaceResources>;

  /// Stages of that life.
  enum class ControllerState { CONSTRUCTED, INITIALIZED, RUNNING, STOPPED };

  virtual ~ControllerBase() = default;

  virtual void starting(const ros::Time& /*time*/) {}
  virtual void update(const ros::Time& time, const ros::Duration& period) = 0;
  virtual void stopping(const ros::Time& /*time*/) {}

  bool isRunning() const { return state_ == ControllerState::RUNNING; }

  /// update(), if the controller runs.
  void updateRequest(const ros::Time& time, const ros::Duration& period) {
    if (isRunning()) update(time, period);
  }

  /// starting(), if it is initialised; false otherwise; so does stopRequest().
  bool startRequest(const ros::Time& time) { return enter(ControllerState::RUNNING, &ControllerBase::starting, time); }
  bool stopRequest(const ros::Time& time) { return enter(ControllerState::STOPPED, &ControllerBase::stopping, time); }

  /// Initialises it on a robot. @param claimed_resources what it claims there. False if it failed.
  virtual bool initRequest(hardware_interface::RobotHW* robot_hw, ros::NodeHandle& root_nh,
                           ros::NodeHandle& controller_nh, ClaimedResources& claimed_resources) = 0;

  ControllerState state_ = ControllerState::CONSTRUCTED;

 private:
  bool enter(ControllerState state, void (ControllerBase::*change)(const ros::Time&), const ros::Time& time) {
    if (state_ == ControllerState::CONSTRUCTED) {
      ROS_FATAL("The controller is not initialized.");
      return false;
    }
    (this->*change)(time);
    state_ = state;
    return true;
  }
};

}  // namespace controller_interface
