#include "process/shutdown.hpp"

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <ros/xmlrpc_manager.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <thread>

namespace jackal_aic {
namespace {

std::atomic<bool> end_requested{false};
std::atomic<bool> signalled{false};
std::atomic<bool> name_taken{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may only touch lock-free atomics");

void onSignal(int) { end_requested = signalled = true; }

/// A text in a request from any sender.
std::string word(XmlRpc::XmlRpcValue& request, int i) {
  const bool given = request.getType() == XmlRpc::XmlRpcValue::TypeArray && request.size() > i &&
                     request[i].getType() == XmlRpc::XmlRpcValue::TypeString;
  return given ? static_cast<std::string>(request[i]) : "";
}

/// shutdown(caller, reason): by the master when another node takes the name of this one, by `rosnode kill`.
void onShutdownRequest(XmlRpc::XmlRpcValue& request, XmlRpc::XmlRpcValue& result) {
  name_taken = word(request, 0) == "/master";
  if (name_taken) {
    ROS_ERROR("Another node was started as %s: this one is down. End one of the two, or give it another name (%s)",
              ros::this_node::getName().c_str(), word(request, 1).c_str());
  } else {
    ROS_INFO("Asked to end by %s: %s", word(request, 0).c_str(), word(request, 1).c_str());
  }
  end_requested = true;
  result = ros::xmlrpc::responseInt(1, "", 0);
}

constexpr double kWait = 0.01;   // s between checks of the request while no callback is due
constexpr double kFlush = 0.15;  // s; roscpp writes to its connections in its own thread and has no flush

}  // namespace

StopRequest::StopRequest() {
  std::signal(SIGINT, onSignal);
  std::signal(SIGTERM, onSignal);
  ros::XMLRPCManager::instance()->unbind("shutdown");
  ros::XMLRPCManager::instance()->bind("shutdown", onShutdownRequest);
}

bool StopRequest::requested() { return end_requested; }

void StopRequest::waitIfNameTaken() {
  while (name_taken && !signalled) std::this_thread::sleep_for(std::chrono::milliseconds(100));
}

void StopRequest::spinWhile(const std::function<bool()>& condition, double longest) {
  const ros::WallTime begin = ros::WallTime::now();
  while (condition() && ros::ok() && (ros::WallTime::now() - begin).toSec() < longest) {
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(kWait));
  }
}

void StopRequest::flush() {
  ros::WallDuration(kFlush).sleep();
  ros::shutdown();
}

}  // namespace jackal_aic
