#pragma once

/// @file
/// The `analyze` tool: prints the stability certificate of a controller on a plant model.

#include <iosfwd>
#include <string>
#include <vector>

namespace jackal_aic {

/// Runs the tool with the arguments after the program's name; see its --help. Returns the exit status: 0
/// if the gains are stable, else 1. @throws ParameterError, or boost::program_options::error for bad options.
int analyze(const std::vector<std::string>& arguments, std::ostream& out);

}  // namespace jackal_aic
