#pragma once

/// @file
/// What all interfaces to hardware have in common: resources that a controller claims.

#include <exception>
#include <set>
#include <string>

namespace hardware_interface {

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

/// Error of an interface, e.g. an unknown joint.
class HardwareInterfaceException : public std::exception {
 public:
  explicit HardwareInterfaceException(const std::string& message) : message_(message) {}
  const char* what() const noexcept override { return message_.c_str(); }

 private:
  std::string message_;
};

}  // namespace hardware_interface
