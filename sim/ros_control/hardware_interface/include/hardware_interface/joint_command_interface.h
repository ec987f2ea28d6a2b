#pragma once

/// @file
/// Joints that can be commanded.

#include "hardware_interface/joint_state_interface.h"

namespace hardware_interface {

/// Reads a joint and writes its command to where the robot takes it from.
class JointHandle : public JointStateHandle {
 public:
  JointHandle(const JointStateHandle& js, double* cmd) : JointStateHandle(js), cmd_(cmd) {}

  void setCommand(double command) { *cmd_ = command; }
  double getCommand() const { return *cmd_; }

 private:
  double* cmd_;
};

/// Joints that take velocities [rad/s], each of one controller at a time.
class VelocityJointInterface : public HardwareResourceManager<JointHandle, ClaimResources> {};

}  // namespace hardware_interface
