#pragma once

/// @file
/// The commands of the experiments program.

#include <string>
#include <vector>

namespace jackal_aic::sim {

/// Runs a command. @param arguments command and its options, without the program's name. Returns the exit status.
/// @throws ParameterError (one line) for whatever the person got wrong.
int runCommand(const std::vector<std::string>& arguments);

}  // namespace jackal_aic::sim
