#pragma once

/// @file
/// Names of types as a person writes them.

#include <cxxabi.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <typeinfo>

namespace hardware_interface::internal {

/// The name of a type as the compiler's typeid has it, readable; unchanged if it cannot be read.
inline std::string demangleSymbol(const char* name) {
  int status = 0;
  const std::unique_ptr<char, void (*)(void*)> readable(abi::__cxa_demangle(name, nullptr, nullptr, &status),
                                                        std::free);
  return status == 0 ? readable.get() : name;
}

/// Name of the type T.
template <class T>
std::string demangledTypeName() {
  return demangleSymbol(typeid(T).name());
}

/// Name of the type of an object, the most derived one.
template <class T>
std::string demangledTypeName(const T& object) {
  return demangleSymbol(typeid(object).name());
}

}  // namespace hardware_interface::internal
