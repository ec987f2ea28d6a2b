#pragma once

/// @file
/// Orderly end of a node: SIGINT, SIGTERM and `rosnode kill` are noticed while publishers still work.

#include <functional>
#include <limits>

namespace jackal_aic {

/// Catches every request to end the node, so that it can publish a last command before roscpp closes its connections.
/// Create one after ros::init() with NoSigintHandler, at most one in a process.
class StopRequest {
 public:
  /// Installs the signal handlers and takes over the master's shutdown request.
  StopRequest();

  /// True once the end is requested.
  static bool requested();

  /// If another node has taken the name of this one, waits for SIGINT or SIGTERM with roscpp shut down: a restarted
  /// process would take the name back.
  static void waitIfNameTaken();

  /// Serves callbacks while a condition holds and roscpp runs, for at most `longest` of wall time [s].
  void spinWhile(const std::function<bool()>& condition, double longest = std::numeric_limits<double>::infinity());

  /// Waits until the last messages have been sent to the subscribers, then shuts roscpp down.
  void flush();
};

}  // namespace jackal_aic
