#pragma once

/// @file
/// Orderly end of a node: SIGINT, SIGTERM and `rosnode kill` are noticed while publishers still work.

#include <functional>
#include <string>

namespace jackal_aic {

/// Catches every request to end the node, so that it can publish a last command before roscpp closes its connections.
/// Create one after ros::init() with NoSigintHandler, at most one in a process.
class StopRequest {
 public:
  /// Installs the signal handlers and takes over the master's shutdown request.
  StopRequest();

  /// Requests the end from within the process.
  static void request();

  /// True once the end is requested.
  static bool requested();

  /// True if the master requested it: another node has taken the name of this one.
  static bool nameTaken();

  /// Waits for SIGINT or SIGTERM with roscpp shut down, because a restarted process would take the name back.
  static void waitForSignal();

  /// Serves callbacks until the end is requested or roscpp is shut down by other means.
  void spinUntilRequested();

  /// Serves callbacks while a condition holds, for at most `longest` of wall time [s].
  void spinWhile(const std::function<bool()>& condition, double longest);

  /// Waits until the last messages have been sent to the subscribers, then shuts roscpp down.
  void flush();
};

}  // namespace jackal_aic
