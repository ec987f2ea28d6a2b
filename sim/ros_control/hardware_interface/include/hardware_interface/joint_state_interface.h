#pragma once

/// @file
/// Joints that can be read.

#include <string>

#include "hardware_interface/internal/hardware_resource_manager.h"

namespace hardware_interface {

/// Reads position [rad], velocity [rad/s] and effort [N m] of a joint from where the robot keeps them.
class JointStateHandle {
 public:
  JointStateHandle(const std::string& name, const double* pos, const double* vel, const double* eff)
      : name_(name), pos_(pos), vel_(vel), eff_(eff) {}

  std::string getName() const { return name_; }
  double getPosition() const { return *pos_; }
  double getVelocity() const { return *vel_; }
  double getEffort() const { return *eff_; }

 private:
  std::string name_;
  const double *pos_, *vel_, *eff_;
};

/// Joints that can be read, by any number of controllers.
class JointStateInterface : public HardwareResourceManager<JointStateHandle> {};

}  // namespace hardware_interface
