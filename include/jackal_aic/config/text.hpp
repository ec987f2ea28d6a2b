#pragma once

/// @file
/// Text from outside (names and values of files, messages and the ROS graph) as it may stand in a line of a log.

#include <cstddef>
#include <string>

namespace jackal_aic {

/// A text as valid UTF-8 that no terminal takes for a command: spaces for its line breaks and tabs, and `\xNN` for the
/// bytes of other control characters (C0, DEL, C1), of those that turn the direction of writing or break lines, and of
/// what is no character of UTF-8. Twice is as once.
std::string onOneLine(const std::string& text);

/// A text on one line, of which no more than the longest [bytes] are shown, in whole characters, and then "...".
std::string shortened(const std::string& text, std::size_t longest = 80);

/// A text of at most 80 bytes on one line, in quotes.
std::string quoted(const std::string& text);

}  // namespace jackal_aic
