#pragma once

/// @file
/// A progress bar on the error output.

#include <unistd.h>

#include <cstdio>
#include <string>

namespace jackal_aic::sim {

/// Draws "label [####      ] 12/80" over itself on a terminal; in a log writes "[ 15%] label" whenever another 5 % are
/// done.
class ProgressBar {
 public:
  ProgressBar(std::string label, std::size_t total, bool enabled)
      : label_(std::move(label)), total_(total), enabled_(enabled), terminal_(isatty(STDERR_FILENO) == 1) {}

  /// Shows a number of finished parts; ends the line at the last one. @param note text behind the numbers.
  void show(std::size_t finished, const std::string& note = "") {
    if (!enabled_ || total_ == 0) return;
    if (!terminal_) return log(100 * finished / total_, note);
    constexpr std::size_t kWidth = 40;
    const std::size_t filled = kWidth * finished / total_;
    std::fprintf(stderr, "\r\033[K%s [%s%s] %zu/%zu %s", label_.c_str(), std::string(filled, '#').c_str(),
                 std::string(kWidth - filled, ' ').c_str(), finished, total_, note.c_str());
    if (finished == total_) std::fputc('\n', stderr);
  }

 private:
  void log(std::size_t percent, const std::string& note) {
    if (percent < logged_ + 5) return;
    logged_ = percent - percent % 5;
    std::fprintf(stderr, "[%3zu%%] %s%s%s\n", percent, label_.c_str(), note.empty() ? "" : ", ", note.c_str());
  }

  std::string label_;
  std::size_t total_;
  bool enabled_;
  bool terminal_;
  std::size_t logged_ = 0;
};

}  // namespace jackal_aic::sim
