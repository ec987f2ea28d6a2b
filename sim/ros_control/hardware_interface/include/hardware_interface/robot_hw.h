#pragma once

/// @file
/// A robot as the controller manager sees it.

#include <ros/node_handle.h>

#include <map>
#include <set>
#include <string>
#include <typeindex>

namespace hardware_interface {

/// Claimed resources of an interface.
struct InterfaceResources {
  std::string hardware_interface;  ///< its type
  std::set<std::string> resources;
};

/// Interfaces to a robot, at most one of each type; derived classes own them and the data behind their handles.
class RobotHW {
 public:
  virtual ~RobotHW() = default;

  template <class T>
  void registerInterface(T* iface) {
    interfaces_[typeid(T)] = iface;
  }

  /// The interface of this type, or nullptr.
  template <class T>
  T* get() {
    const auto found = interfaces_.find(typeid(T));
    return found == interfaces_.end() ? nullptr : static_cast<T*>(found->second);
  }

  /// Takes the state of the robot into the data behind the handles.
  virtual void read(const ros::Time& /*time*/, const ros::Duration& /*period*/) {}

  /// Gives the commands behind the handles to the robot.
  virtual void write(const ros::Time& /*time*/, const ros::Duration& /*period*/) {}

 private:
  std::map<std::type_index, void*> interfaces_;
};

}  // namespace hardware_interface
