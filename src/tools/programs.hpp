#pragma once

/// @file
/// The command line tools. Each takes the arguments after its name and returns its exit status; see its --help.
/// @throws an exception of one line, naming the file.

#include <iosfwd>
#include <string>
#include <vector>

namespace jackal_aic {

/// Prints the stability certificate of a controller on a plant model; 0 if the gains are stable, else 1.
int analyze(const std::vector<std::string>& arguments, std::ostream& out);

/// Replays a recorded drive through the same code; 1 with --check if it differs from the recording.
int replay(const std::vector<std::string>& arguments, std::ostream& out);

}  // namespace jackal_aic
