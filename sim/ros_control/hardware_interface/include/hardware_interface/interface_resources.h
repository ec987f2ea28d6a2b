#pragma once

/// @file
/// Resources of one interface.

#include <set>
#include <string>

namespace hardware_interface {

/// Resources of an interface.
struct InterfaceResources {
  InterfaceResources() = default;
  InterfaceResources(const std::string& hw_iface, const std::set<std::string>& res)
      : hardware_interface(hw_iface), resources(res) {}

  std::string hardware_interface;  ///< its type
  std::set<std::string> resources;
};

}  // namespace hardware_interface
