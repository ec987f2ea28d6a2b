#pragma once

/// @file
/// Handles by name.

#include <ros/console.h>

#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "hardware_interface/internal/demangle_symbol.h"

namespace hardware_interface {

/// Base of all resource managers.
class ResourceManagerBase {
 public:
  virtual ~ResourceManagerBase() = default;
};

/// Keeps handles by their name. ResourceHandle has std::string getName() const.
template <class ResourceHandle>
class ResourceManager : public ResourceManagerBase {
 public:
  using ResourceManagerType = ResourceManager<ResourceHandle>;

  /// Names of all handles, sorted.
  std::vector<std::string> getNames() const {
    std::vector<std::string> names;
    for (const auto& entry : resource_map_) names.push_back(entry.first);
    return names;
  }

  /// Adds a handle, in place of one of the same name.
  void registerHandle(const ResourceHandle& handle) {
    const bool added = resource_map_.insert_or_assign(handle.getName(), handle).second;
    if (added) return;
    ROS_WARN_STREAM("Handle '" << handle.getName() << "' replaced in '" << internal::demangledTypeName(*this) << "'.");
  }

  /// @throws std::logic_error without a handle of that name.
  ResourceHandle getHandle(const std::string& name) {
    const auto found = resource_map_.find(name);
    if (found != resource_map_.end()) return found->second;
    throw std::logic_error("Could not find resource '" + name + "' in '" + internal::demangledTypeName(*this) + "'.");
  }

 protected:
  using ResourceMap = std::map<std::string, ResourceHandle>;
  ResourceMap resource_map_;
};

}  // namespace hardware_interface
