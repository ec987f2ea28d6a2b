#pragma once

/// @file
/// Text files, for everything that runs without a ROS parameter server.

#include <cstddef>
#include <limits>
#include <string>

namespace jackal_aic {

/// Text of a file, of which no more than `most` bytes are read. @throws ParameterError, one line, if it is a directory
/// or cannot be read.
std::string readText(const std::string& path, std::size_t most = std::numeric_limits<std::size_t>::max());

}  // namespace jackal_aic
