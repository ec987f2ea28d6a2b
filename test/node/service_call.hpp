#pragma once

/// @file
/// Calls of ROS services that do not fail by chance.

#include <ros/service.h>

#include <string>

namespace jackal_aic::sim {

/// Calls a service once it is there, and again if the call fails: roscpp sometimes closes the connection before it has
/// read the answer (github.com/ros/ros_comm/issues/1976). So it is for services that may be called twice. False if
/// several calls failed, the service did not appear within `patience` (negative: any time), or ROS was shut down.
/// @param call request and, afterwards, response.
template <class Service>
bool callService(const std::string& name, Service& call, const ros::Duration& patience = ros::Duration(-1)) {
  constexpr int kAttempts = 5;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    if (!ros::service::waitForService(name, patience)) return false;
    if (ros::service::call(name, call)) return true;
  }
  return false;
}

}  // namespace jackal_aic::sim
