#pragma once

/// @file
/// Text from outside (names and values of files, messages and the ROS graph) as it may stand in a line of a log.

#include <cstddef>
#include <string>

namespace jackal_aic {

/// A text as valid UTF-8 without terminal commands: spaces for line breaks and tabs, and `\xNN` for the bytes of other
/// control characters (C0, DEL, C1), bidirectional controls, line separators and invalid UTF-8. Idempotent.
std::string onOneLine(const std::string& text);

/// A text on one line, cut to at most `longest` bytes of whole characters and "...".
std::string shortened(const std::string& text, std::size_t longest = 80);

/// A text of at most 80 bytes on one line, in quotes.
std::string quoted(const std::string& text);

}  // namespace jackal_aic
