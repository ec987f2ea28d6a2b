#pragma once

/// @file
/// Runs a command for a test.

#include <sys/wait.h>

#include <cstdio>
#include <stdexcept>
#include <string>

namespace jackal_aic {

/// What a command printed, errors too, and how it ended.
struct CommandResult {
  std::string text;
  int status;  ///< exit status; -1 if a signal ended it
};

/// Runs a command of the shell to its end. @throws std::runtime_error if it cannot be started.
inline CommandResult runCommand(const std::string& command) {
  FILE* pipe = popen(("exec 2>&1; " + command).c_str(), "r");
  if (pipe == nullptr) throw std::runtime_error("cannot start " + command);
  CommandResult result{};
  char part[4096];
  for (std::size_t n; (n = fread(part, 1, sizeof part, pipe)) > 0;) result.text.append(part, n);
  const int status = pclose(pipe);
  result.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return result;
}

}  // namespace jackal_aic
