#pragma once

/// @file
/// Interfaces by their type.

#include <map>
#include <string>
#include <vector>

#include "hardware_interface/internal/demangle_symbol.h"

namespace hardware_interface {

/// Keeps at most one interface of each type.
class InterfaceManager {
 public:
  /// Adds an interface, in place of one of the same type. It has to outlive the manager.
  template <class T>
  void registerInterface(T* iface) {
    const std::string type = internal::demangledTypeName<T>();
    interfaces_[type] = iface;
    resources_[type] = iface->getNames();
  }

  /// The interface of this type, or nullptr.
  template <class T>
  T* get() {
    const auto found = interfaces_.find(internal::demangledTypeName<T>());
    return found == interfaces_.end() ? nullptr : static_cast<T*>(found->second);
  }

  /// Types of all interfaces.
  std::vector<std::string> getNames() const {
    std::vector<std::string> names;
    for (const auto& entry : interfaces_) names.push_back(entry.first);
    return names;
  }

  /// Names of the handles that an interface had when it was registered.
  std::vector<std::string> getInterfaceResources(std::string iface_type) const {
    const auto found = resources_.find(iface_type);
    return found == resources_.end() ? std::vector<std::string>{} : found->second;
  }

 protected:
  std::map<std::string, void*> interfaces_;
  std::map<std::string, std::vector<std::string>> resources_;
};

}  // namespace hardware_interface
