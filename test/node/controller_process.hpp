#pragma once

/// @file
/// The controller node as a child process of a test.

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace jackal_aic::test {

/// A controller_node process of its own, or another node of the package, with stderr in a file.
class ControllerProcess {
 public:
  /// @param remappings further arguments of the node, as "from:=to".
  explicit ControllerProcess(const std::string& name, const std::string& executable = "controller_node",
                             const std::vector<std::string>& remappings = {})
      : errors_("/tmp/" + name + "_" + std::to_string(getpid()) + "_" + std::to_string(++count_)), pid_(fork()) {
    std::vector<std::string> words = {"rosrun", "jackal_aic", executable, "__name:=" + name};
    words.insert(words.end(), remappings.begin(), remappings.end());
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    if (pid_ == 0) {
      const int file = open(errors_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
      dup2(file, STDERR_FILENO);
      execvp(arguments[0], arguments.data());
      _exit(127);
    }
  }
  ~ControllerProcess() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    unlink(errors_.c_str());
  }

  void signal(int number) const { kill(pid_, number); }

  bool ended() {
    if (pid_ > 0 && waitpid(pid_, &status_, WNOHANG) == pid_) pid_ = -1;
    return pid_ < 0;
  }

  int exitStatus() const { return WIFEXITED(status_) ? WEXITSTATUS(status_) : -1; }

  std::string errors() const {
    std::ifstream file(errors_);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }

 private:
  inline static int count_ = 0;

  std::string errors_;
  pid_t pid_;
  int status_ = -1;
};

}  // namespace jackal_aic::test
