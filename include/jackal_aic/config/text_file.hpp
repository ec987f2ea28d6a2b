#pragma once

/// @file
/// Text files, for programs without a ROS parameter server.

#include <cstddef>
#include <string>

namespace jackal_aic {

/// Text of a file, or of a pipe up to its end (<(command) of a shell).
/// @param most largest number of bytes. @throws ParameterError, one line, if it is larger, a directory, a device or a
/// socket, or cannot be read.
std::string readText(const std::string& path, std::size_t most = std::size_t{16} << 20);

}  // namespace jackal_aic
