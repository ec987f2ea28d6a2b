#pragma once

/// @file
/// Other publishers in the ROS graph: of our commands, and of the inputs that have to be connected before the robot
/// drives.

#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <ros/wall_timer.h>

#include <atomic>
#include <mutex>
#include <string>
#include <vector>

#include "inputs/set_points.hpp"

namespace jackal_aic {

/// Asks the master who publishes on given topics. A node that has died does not count, although the master lists it.
/// While the master cannot be reached the last answer stands.
class OtherPublishers {
 public:
  /// @param commands topics of our commands, resolved names; empty: any node may publish there; @param emergency_stop,
  /// set_points inputs: before their publishers are connected, silence has no meaning.
  OtherPublishers(std::vector<std::string> commands, const ros::Subscriber& emergency_stop,
                  const SetPointSource& set_points)
      : commands_(std::move(commands)), emergency_stop_({emergency_stop}), set_points_(set_points.subscribers()) {}

  /// Asks now, and then periodically in the thread of a node handle. That thread waits for the answers, so it must not
  /// drive.
  /// @param until_checked ends once checked() and setPointsConnected() hold, for an owner that needs nothing else.
  void watch(ros::NodeHandle node, bool until_checked = false);

  /// True once the master has answered and every publisher of the emergency stop is connected, for long enough that
  /// what it latched has arrived.
  bool checked() const { return emergency_stop_.connected; }

  /// The same of the set points, which a publisher sends all the time.
  bool setPointsConnected() const { return set_points_.connected; }

  /// True if the master answered last time.
  bool masterReachable() const { return master_reachable_; }

  /// True if another node publishes on one of our topics.
  bool contended() const { return contended_; }

  /// Publishers with their topics, or missing ones, and a remedy: "/name on /cmd_drive, ...". Else empty.
  std::string text() const;

 private:
  /// Topics whose publishers have to be connected.
  struct Input {
    explicit Input(std::vector<ros::Subscriber> s) : subscribers(std::move(s)) {}
    const std::vector<ros::Subscriber> subscribers;
    ros::WallTime unconnected = ros::WallTime::now();  // last check at which one was not connected, or the start
    std::atomic<bool> connected{false};
  };

  void check();

  const std::vector<std::string> commands_;
  Input emergency_stop_, set_points_;
  std::atomic<bool> master_reachable_{true};
  std::atomic<bool> contended_{false};
  mutable std::mutex mutex_;  // of the text
  std::string text_;
  ros::WallTimer timer_;
};

}  // namespace jackal_aic
