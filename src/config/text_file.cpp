#include "jackal_aic/config/text_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/config/text.hpp"

namespace jackal_aic {
namespace {

constexpr int kPatience = 10000;  // in which a pipe has to say something [ms]

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw ParameterError(onOneLine(path) + ": " + what);
}

/// True for a pipe. Checked before opening, because opening a device may have side effects.
bool isPipe(const std::string& path) {
  struct stat file {};
  if (stat(path.c_str(), &file) != 0) fail(path, "cannot be read");
  if (S_ISDIR(file.st_mode)) fail(path, "is a directory");
  if (!S_ISREG(file.st_mode) && !S_ISFIFO(file.st_mode)) fail(path, "is a device or a socket, not a file");
  return S_ISFIFO(file.st_mode);
}

/// A file or pipe that is open for reading.
class Source {
 public:
  explicit Source(const std::string& path)
      : path_(path), descriptor_(open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC)) {
    if (descriptor_ < 0) fail(path_, "cannot be read");
  }
  ~Source() { close(descriptor_); }
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  /// Appends what comes next; false at the end.
  bool read(std::string& text) {
    const ssize_t got = ::read(descriptor_, block_.data(), block_.size());
    if (got < 0 && errno == EAGAIN) {
      await();
      return true;
    }
    if (got < 0 && errno != EINTR) fail(path_, "cannot be read");
    if (got > 0) text.append(block_.data(), static_cast<std::size_t>(got));
    return got != 0;
  }

 private:
  void await() {
    pollfd pipe{descriptor_, POLLIN, 0};
    if (poll(&pipe, 1, kPatience) == 0) fail(path_, "is a pipe from which nothing has come for 10 s");
  }

  const std::string& path_;
  int descriptor_;
  std::array<char, 65536> block_;
};

}  // namespace

std::string readText(const std::string& path, std::size_t most) {
  const bool pipe = isPipe(path);
  Source source(path);
  std::string text;
  while (text.size() <= most && source.read(text)) {
  }
  if (text.size() > most) fail(path, fmt::format("more than {} MiB of text", most >> 20));
  if (pipe && text.empty()) fail(path, "is a pipe without a writer");
  return text;
}

}  // namespace jackal_aic
