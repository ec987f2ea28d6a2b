#pragma once

/// @file
/// Real-time scheduling of the threads that take measurements and command the motors.

#include <ros/node_handle.h>
#include <ros/timer.h>
#include <sys/types.h>

#include <vector>

namespace jackal_aic {

/// Remembers the threads there are, those of roscpp that receive messages and wait for timers and the one that will
/// spin, and gives them a real-time scheduling later: what is started in between (diagnostics, graph, tf) stays as it
/// is.
class RealTimeThreads {
 public:
  /// Those of this process, now. @param node any: roscpp's threads run while there is one.
  explicit RealTimeThreads(const ros::NodeHandle& node);

  /// Schedules them first in, first out (SCHED_FIFO) and keeps the memory of the process from being swapped out. Tells
  /// in one line what it did, or why it could not; the node runs on as before then. @param priority 1..99, 0: nothing.
  void schedule(int priority) const;

 private:
  ros::Timer timer_;  // roscpp's thread that waits for timers begins with the first one
  std::vector<pid_t> threads_;
};

}  // namespace jackal_aic
