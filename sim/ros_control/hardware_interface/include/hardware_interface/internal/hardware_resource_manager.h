#pragma once

/// @file
/// Handles of hardware, which a controller may have to claim.

#include <stdexcept>
#include <string>

#include "hardware_interface/hardware_interface.h"
#include "hardware_interface/internal/resource_manager.h"

namespace hardware_interface {

/// Getting a handle claims it: one controller at a time.
struct ClaimResources {
  static void claim(HardwareInterface* hw, const std::string& name) { hw->claim(name); }
};

/// Any number of controllers may have the handle.
struct DontClaimResources {
  static void claim(HardwareInterface*, const std::string&) {}
};

/// Interface to hardware by its handles.
template <class ResourceHandle, class ClaimPolicy = DontClaimResources>
class HardwareResourceManager : public HardwareInterface, public ResourceManager<ResourceHandle> {
 public:
  using ResourceHandleType = ResourceHandle;

  /// @throws HardwareInterfaceException without a handle of that name.
  ResourceHandle getHandle(const std::string& name) {
    try {
      ResourceHandle handle = ResourceManager<ResourceHandle>::getHandle(name);
      ClaimPolicy::claim(this, name);
      return handle;
    } catch (const std::logic_error& error) {
      throw HardwareInterfaceException(error.what());
    }
  }
};

}  // namespace hardware_interface
