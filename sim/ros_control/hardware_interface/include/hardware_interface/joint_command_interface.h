#pragma once

/// @file
/// Joints that can be commanded.

#include <string>

#include "hardware_interface/internal/hardware_resource_manager.h"
#include "hardware_interface/joint_state_interface.h"

namespace hardware_interface {

/// Reads a joint and writes its command to where the robot takes it from.
class JointHandle : public JointStateHandle {
 public:
  JointHandle() = default;

  /// @throws HardwareInterfaceException if the pointer is null.
  JointHandle(const JointStateHandle& js, double* cmd) : JointStateHandle(js), cmd_(cmd) {
    if (!cmd) {
      throw HardwareInterfaceException("Cannot create handle '" + js.getName() + "'. Command data pointer is null.");
    }
  }

  void setCommand(double command) { *cmd_ = command; }
  double getCommand() const { return *cmd_; }
  const double* getCommandPtr() const { return cmd_; }

 private:
  double* cmd_ = nullptr;
};

/// Joints that can be commanded, by one controller at a time.
class JointCommandInterface : public HardwareResourceManager<JointHandle, ClaimResources> {};

/// Commands are efforts [N m].
class EffortJointInterface : public JointCommandInterface {};

/// Commands are velocities [rad/s].
class VelocityJointInterface : public JointCommandInterface {};

/// Commands are positions [rad].
class PositionJointInterface : public JointCommandInterface {};

}  // namespace hardware_interface
