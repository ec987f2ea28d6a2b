#pragma once

/// @file
/// The `replay` tool: a recorded drive through the same code again, without ROS running.

#include <iosfwd>
#include <string>
#include <vector>

namespace jackal_aic {

/// Runs the tool with the arguments after the program's name; see its --help. Returns the exit status: 1 with --check
/// if the replay differs from what was recorded, else 0. @throws ParameterError for what it cannot do, naming the file,
/// boost::program_options::error for bad options.
int replay(const std::vector<std::string>& arguments, std::ostream& out);

}  // namespace jackal_aic
