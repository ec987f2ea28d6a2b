#pragma once

/// @file
/// `--help` of the nodes, which needs no master.

#include <algorithm>
#include <cstdio>
#include <string>

namespace jackal_aic {

/// Prints how a node is used if that is asked for (--help, -h); true if it was. To be called before ros::init().
/// @param name of the program; @param text what it does, in lines of its own.
inline bool printedHelp(int argc, char** argv, const char* name, const char* text) {
  const bool asked =
      std::any_of(argv, argv + argc, [](const std::string& word) { return word == "--help" || word == "-h"; });
  if (!asked) return false;
  std::printf(
      "Usage: rosrun jackal_aic %s [_parameter:=value ...] [topic:=name ...]\n%s"
      "Needs a ROS master. Topics and parameters: doc/reference/ of the package.\n",
      name, text);
  return true;
}

}  // namespace jackal_aic
