#pragma once

/// @file
/// Comma-separated values.

#include <string>

namespace jackal_aic::sim {

/// A text as a field of a CSV file (RFC 4180): in quotes if it needs them.
inline std::string csvField(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted.append(c == '"' ? 2 : 1, c);
  return quoted + "\"";
}

}  // namespace jackal_aic::sim
