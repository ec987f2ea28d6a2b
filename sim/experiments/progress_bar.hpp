#pragma once

/// @file
/// A progress bar on the error output.

#include <unistd.h>

#include <cstdio>
#include <string>

namespace jackal_aic::sim {

/// Draws "label [####      ] 12/80" over itself; nothing if it is switched off or the error output is not a terminal.
class ProgressBar {
 public:
  ProgressBar(std::string label, std::size_t total, bool enabled)
      : label_(std::move(label)), total_(total), enabled_(enabled && isatty(STDERR_FILENO) == 1) {}

  /// Shows a number of finished parts; ends the line at the last one. @param note text behind the numbers.
  void show(std::size_t finished, const std::string& note = "") {
    if (!enabled_ || total_ == 0) return;
    constexpr std::size_t kWidth = 40;
    const std::size_t filled = kWidth * finished / total_;
    std::fprintf(stderr, "\r%s [%s%s] %zu/%zu %s", label_.c_str(), std::string(filled, '#').c_str(),
                 std::string(kWidth - filled, ' ').c_str(), finished, total_, note.c_str());
    if (finished == total_) std::fputc('\n', stderr);
  }

 private:
  std::string label_;
  std::size_t total_;
  bool enabled_;
};

}  // namespace jackal_aic::sim
