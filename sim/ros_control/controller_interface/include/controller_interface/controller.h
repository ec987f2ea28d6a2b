#pragma once

/// @file
/// A controller on one interface.

#include <controller_interface/controller_base.h>

#include <boost/core/demangle.hpp>
#include <string>

namespace controller_interface {

/// A controller that needs the interface T and no other.
template <class T>
class Controller : public virtual ControllerBase {
 public:
  virtual bool init(T* hw, ros::NodeHandle& root_nh, ros::NodeHandle& controller_nh) = 0;

 protected:
  bool initRequest(hardware_interface::RobotHW* robot_hw, ros::NodeHandle& root_nh, ros::NodeHandle& controller_nh,
                   ClaimedResources& claimed_resources) override {
    T* hw = robot_hw->get<T>();
    const std::string type = boost::core::demangle(typeid(T).name());
    if (state_ != ControllerState::CONSTRUCTED || !hw) {
      ROS_ERROR("This controller requires a hardware interface of type '%s', and can be initialized once.",
                type.c_str());
      return false;
    }
    hw->clearClaims();
    if (!init(hw, root_nh, controller_nh)) {
      ROS_ERROR("Failed to initialize the controller");
      return false;
    }
    claimed_resources.assign(1, {type, hw->getClaims()});
    hw->clearClaims();
    state_ = ControllerState::INITIALIZED;
    return true;
  }
};

}  // namespace controller_interface
