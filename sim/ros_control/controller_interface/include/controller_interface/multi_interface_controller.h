#pragma once

/// @file
/// A controller on several interfaces.

#include <controller_interface/controller_base.h>
#include <hardware_interface/internal/demangle_symbol.h>

namespace controller_interface {

/// A controller on the interfaces T; it needs all of them unless they are optional.
template <typename... T>
class MultiInterfaceController : public virtual ControllerBase {
 public:
  explicit MultiInterfaceController(bool allow_optional_interfaces = false)
      : allow_optional_interfaces_(allow_optional_interfaces) {}

  virtual bool init(hardware_interface::RobotHW* /*robot_hw*/, ros::NodeHandle& /*controller_nh*/) { return true; }
  virtual bool init(hardware_interface::RobotHW* /*robot_hw*/, ros::NodeHandle& /*root_nh*/,
                    ros::NodeHandle& /*controller_nh*/) {
    return true;
  }

 protected:
  bool initRequest(hardware_interface::RobotHW* robot_hw, ros::NodeHandle& root_nh, ros::NodeHandle& controller_nh,
                   ClaimedResources& claimed_resources) override {
    if (state_ != ControllerState::CONSTRUCTED) return false;
    if (!allow_optional_interfaces_ && !(robot_hw->get<T>() && ...)) {
      ROS_ERROR("This controller requires hardware interfaces that the robot does not have.");
      return false;
    }
    (hand<T>(robot_hw), ...);
    if (!init(&robot_hw_ctrl_, controller_nh) || !init(&robot_hw_ctrl_, root_nh, controller_nh)) {
      ROS_ERROR("Failed to initialize the controller");
      return false;
    }
    claimed_resources.clear();
    (collect<T>(claimed_resources), ...);
    state_ = ControllerState::INITIALIZED;
    return true;
  }

  hardware_interface::RobotHW robot_hw_ctrl_;  ///< with those of the interfaces T that the robot has
  bool allow_optional_interfaces_;

 private:
  template <class U>
  void hand(hardware_interface::RobotHW* robot_hw) {
    U* hw = robot_hw->get<U>();
    if (!hw) return;
    hw->clearClaims();
    robot_hw_ctrl_.registerInterface(hw);
  }

  template <class U>
  void collect(ClaimedResources& claimed_resources) {
    U* hw = robot_hw_ctrl_.get<U>();
    if (!hw) return;
    claimed_resources.emplace_back(hardware_interface::internal::demangledTypeName<U>(), hw->getClaims());
    hw->clearClaims();
  }
};

}  // namespace controller_interface
