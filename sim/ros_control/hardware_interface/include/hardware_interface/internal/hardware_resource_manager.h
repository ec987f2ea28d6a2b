#pragma once

/// @file
/// Interfaces to hardware: handles by name, which a controller may have to claim.

#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace hardware_interface {

/// Error of an interface, e.g. an unknown joint.
class HardwareInterfaceException : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// An interface to resources of one kind. Claims are collected while a controller initialises.
class HardwareInterface {
 public:
  virtual ~HardwareInterface() = default;
  virtual void claim(std::string resource) { claims_.insert(resource); }
  void clearClaims() { claims_.clear(); }
  std::set<std::string> getClaims() const { return claims_; }

 private:
  std::set<std::string> claims_;
};

struct ClaimResources {};      ///< getting a handle claims it: one controller at a time
struct DontClaimResources {};  ///< any number of controllers may have the handle

/// Interface to hardware by its handles. ResourceHandle has std::string getName() const.
template <class ResourceHandle, class ClaimPolicy = DontClaimResources>
class HardwareResourceManager : public HardwareInterface {
 public:
  /// Adds a handle, in place of one of the same name.
  void registerHandle(const ResourceHandle& handle) { resource_map_.insert_or_assign(handle.getName(), handle); }

  /// Names of all handles, sorted.
  std::vector<std::string> getNames() const {
    std::vector<std::string> names;
    for (const auto& entry : resource_map_) names.push_back(entry.first);
    return names;
  }

  /// @throws HardwareInterfaceException without a handle of that name.
  ResourceHandle getHandle(const std::string& name) {
    const auto found = resource_map_.find(name);
    if (found == resource_map_.end()) throw HardwareInterfaceException("Could not find resource '" + name + "'.");
    if (std::is_same<ClaimPolicy, ClaimResources>::value) claim(name);
    return found->second;
  }

 private:
  std::map<std::string, ResourceHandle> resource_map_;
};

}  // namespace hardware_interface
