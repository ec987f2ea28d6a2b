#include "stop_request.hpp"

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <ros/xmlrpc_manager.h>

#include <atomic>
#include <csignal>

namespace jackal_aic {
namespace {

std::atomic<bool> end_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may only touch lock-free atomics");

void onSignal(int) { end_requested = true; }

/// The master calls shutdown(caller, reason) of a node for `rosnode kill` and when another node takes its name.
void onMasterRequest(XmlRpc::XmlRpcValue&, XmlRpc::XmlRpcValue& result) {
  end_requested = true;
  result = ros::xmlrpc::responseInt(1, "", 0);
}

constexpr double kWait = 0.01;   // s between looks at the request while no callback is due
constexpr double kFlush = 0.15;  // s; roscpp writes to its connections from a thread of its own and offers no flush

}  // namespace

StopRequest::StopRequest() {
  std::signal(SIGINT, onSignal);
  std::signal(SIGTERM, onSignal);
  ros::XMLRPCManager::instance()->unbind("shutdown");
  ros::XMLRPCManager::instance()->bind("shutdown", onMasterRequest);
}

void StopRequest::request() { end_requested = true; }

bool StopRequest::requested() { return end_requested; }

void StopRequest::spinUntilRequested() {
  while (!end_requested && ros::ok()) ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(kWait));
}

void StopRequest::spinWhile(const std::function<bool()>& condition, double longest) {
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(longest);
  while (condition() && ros::ok() && ros::WallTime::now() < end) {
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(kWait));
  }
}

void StopRequest::flush() {
  ros::WallDuration(kFlush).sleep();
  ros::shutdown();
}

}  // namespace jackal_aic
