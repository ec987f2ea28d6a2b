#pragma once

/// @file
/// Other publishers in the ROS graph: of our commands, and of the emergency stop.

#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <ros/wall_timer.h>

#include <atomic>
#include <mutex>
#include <string>
#include <vector>

namespace jackal_aic {

/// Asks the master who publishes on given topics. A node that has died does not count, although the master lists it.
/// While the master cannot be reached the last answer stands.
class OtherPublishers {
 public:
  /// @param commands topics of our commands, resolved names; empty: any node may publish there; @param emergency_stop
  /// has to be connected to each of its publishers before the robot drives; it has to outlive this.
  OtherPublishers(std::vector<std::string> commands, const ros::Subscriber* emergency_stop)
      : commands_(std::move(commands)), emergency_stop_(emergency_stop) {}

  /// Asks, and asks again and again in the thread of a node handle, which waits for the answers: not one that drives.
  /// @param until_checked ends once checked() holds, for an owner that needs nothing else of this.
  void watch(ros::NodeHandle node, bool until_checked = false);

  /// True once the master has answered and every publisher of the emergency stop is connected: its latched message has
  /// then arrived.
  bool checked() const { return checked_; }

  /// True if the master answered last time.
  bool masterReachable() const { return master_reachable_; }

  /// True if another node publishes on one of our topics.
  bool contended() const { return contended_; }

  /// Publishers with their topics, or missing ones, and a remedy: "/name on /cmd_drive, ...". Else empty.
  std::string text() const;

 private:
  void look();

  const std::vector<std::string> commands_;
  const ros::Subscriber* emergency_stop_;
  bool connected_ = false;  // the emergency stop, at the last check
  std::atomic<bool> checked_{false};
  std::atomic<bool> master_reachable_{true};
  std::atomic<bool> contended_{false};
  mutable std::mutex mutex_;  // of the text
  std::string text_;
  ros::WallTimer timer_;
};

}  // namespace jackal_aic
