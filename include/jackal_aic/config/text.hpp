#pragma once

/// @file
/// Text from outside: files, and names and values as they may stand in a line of a log.

#include <cstddef>
#include <string>

namespace jackal_aic {

/// A text without terminal commands: spaces for line breaks and tabs, `\xNN` for other control characters of ASCII.
std::string onOneLine(const std::string& text);

/// A text on one line, cut to at most `longest` bytes of whole characters and "...".
std::string shortened(const std::string& text, std::size_t longest = 80);

/// A text of at most 80 bytes on one line, in quotes.
std::string quoted(const std::string& text);

/// Text of a file, or of a pipe up to its end (<(command) of a shell).
/// @param most largest number of bytes. @throws ParameterError, one line, if it is larger, a directory, a device or a
/// socket, or cannot be read.
std::string readText(const std::string& path, std::size_t most = std::size_t{16} << 20);

}  // namespace jackal_aic
