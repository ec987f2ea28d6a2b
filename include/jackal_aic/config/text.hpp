#pragma once

/// @file
/// Text from outside (names and values of files, messages and the ROS graph) as it may stand in a line of a log.

#include <string>

namespace jackal_aic {

/// A text with spaces for its control characters: a message is one line, and no terminal takes it for a command.
std::string onOneLine(std::string text);

/// A text on one line, cut off after 80 characters.
std::string shortened(const std::string& text);

/// The same in quotes.
std::string quoted(const std::string& text);

}  // namespace jackal_aic
