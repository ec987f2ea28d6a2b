#pragma once

/// @file
/// The operating system's view of a ROS node.

#include <sys/types.h>

#include <cstddef>
#include <optional>
#include <string>

namespace jackal_aic::sim {

/// Process id of a node that runs on this machine, asked of the node itself; empty if it is not there.
std::optional<pid_t> processOf(const std::string& node_name);

/// Process id of the ROS master; empty if it does not answer.
std::optional<pid_t> masterProcess();

/// Whether a process exists and has not ended.
bool isRunning(pid_t process);

/// Memory of a process that is in RAM [bytes]; 0 if it does not exist.
std::size_t residentMemory(pid_t process);

}  // namespace jackal_aic::sim
