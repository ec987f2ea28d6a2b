#pragma once

/// @file
/// Interfaces by their type.

#include <map>
#include <string>

#include "hardware_interface/internal/demangle_symbol.h"

namespace hardware_interface {

/// Keeps at most one interface of each type.
class InterfaceManager {
 public:
  /// Adds an interface, in place of one of the same type. It has to outlive the manager.
  template <class T>
  void registerInterface(T* iface) {
    interfaces_[internal::demangledTypeName<T>()] = iface;
  }

  /// The interface of this type, or nullptr.
  template <class T>
  T* get() {
    const auto found = interfaces_.find(internal::demangledTypeName<T>());
    return found == interfaces_.end() ? nullptr : static_cast<T*>(found->second);
  }

 protected:
  std::map<std::string, void*> interfaces_;
};

}  // namespace hardware_interface
