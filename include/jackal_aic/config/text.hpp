#pragma once

/// @file
/// Text from outside (names and values of files, messages and the ROS graph) as it may stand in a line of a log.

#include <cstddef>
#include <string>

namespace jackal_aic {

/// A text without terminal commands: spaces for line breaks and tabs, `\xNN` for other control characters of ASCII.
std::string onOneLine(const std::string& text);

/// A text on one line, cut to at most `longest` bytes of whole characters and "...".
std::string shortened(const std::string& text, std::size_t longest = 80);

/// A text of at most 80 bytes on one line, in quotes.
std::string quoted(const std::string& text);

}  // namespace jackal_aic
