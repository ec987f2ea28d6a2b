#pragma once

/// @file
/// The command line tools. Each takes the arguments after its name and returns its exit status; see its --help.
/// @throws an exception of one line, naming the file, for what it cannot do.

#include <iosfwd>
#include <string>
#include <vector>

namespace jackal_aic {

/// Prints the stability certificate of a controller on a plant model; 0 if the gains are stable, else 1.
int analyze(const std::vector<std::string>& arguments, std::ostream& out);

/// Fits a plant model to a recorded drive.
int identify(const std::vector<std::string>& arguments, std::ostream& out);

/// Drives a recorded drive through the same code again; 1 with --check if it differs from what was recorded.
int replay(const std::vector<std::string>& arguments, std::ostream& out);

}  // namespace jackal_aic
