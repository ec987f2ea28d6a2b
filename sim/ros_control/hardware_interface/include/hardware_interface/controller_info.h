#pragma once

/// @file
/// What the controller manager knows of a controller.

#include <string>
#include <vector>

#include "hardware_interface/interface_resources.h"

namespace hardware_interface {

/// Name, type and claims of a controller.
struct ControllerInfo {
  std::string name;
  std::string type;
  std::vector<InterfaceResources> claimed_resources;
};

}  // namespace hardware_interface
