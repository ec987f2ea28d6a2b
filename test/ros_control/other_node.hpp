#pragma once

/// @file
/// Other nodes than those of a test.

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>

namespace jackal_aic::test {

/// A node of its own; it ends with this.
class OtherNode {
 public:
  /// @param command of the shell, which starts it.
  explicit OtherNode(const std::string& command) : pid_(fork()) {
    if (pid_ != 0) return;
    setsid();
    execl("/bin/sh", "sh", "-c", ("exec " + command).c_str(), nullptr);
    _exit(127);
  }
  ~OtherNode() {
    kill(-pid_, SIGTERM);  // the shell and what it started
    waitpid(pid_, nullptr, 0);
  }

 private:
  pid_t pid_;
};

}  // namespace jackal_aic::test
