#include "bag_guard.hpp"

#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>
#include <stdexcept>

#include "jackal_aic/config/text.hpp"

namespace jackal_aic {
namespace {

/// One line of what the bag library says, cut where it quotes the damaged file at length.
std::string oneLine(const char* reason) {
  constexpr std::size_t kLongest = 200;
  std::string line = shortened(reason, kLongest);
  while (!line.empty() && line.back() == ' ') line.pop_back();
  return line;
}

}  // namespace

void boundMemory(const std::string& path) {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // whose shadow memory is far beyond any bound
  struct stat file {};
  const rlim_t size = stat(path.c_str(), &file) == 0 ? static_cast<rlim_t>(file.st_size) : 0;
  const rlim_t bound = (rlim_t{2} << 30) + 4 * size;
  const rlimit limit{bound, bound};
  setrlimit(RLIMIT_AS, &limit);
#else
  static_cast<void>(path);
#endif
}

std::string unreadableBag(const std::string& path, const std::exception& error) {
  const std::string what = path + ": cannot be read as a bag: ";
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr) return what + "a length in it is beyond all memory";
  return what + oneLine(error.what());
}

std::string noFile(const std::string& path) {
  struct stat file {};
  if (stat(path.c_str(), &file) != 0 || S_ISREG(file.st_mode)) return "";
  return path + ": cannot be read as a bag: it is " + (S_ISDIR(file.st_mode) ? "a directory" : "no file");
}

int withBag(const std::string& path, const std::function<int()>& work) {
  if (const std::string refusal = noFile(path); !refusal.empty()) throw std::runtime_error(refusal);
  std::fflush(nullptr);  // what is buffered would else be written by both
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error(path + ": cannot be read: " + std::strerror(errno));
  if (child == 0) {
    boundMemory(path);
    const int status = work();
    std::fflush(nullptr);
    _exit(status);
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status)) return WEXITSTATUS(status);
  throw std::runtime_error(path + ": cannot be read as a bag: it is damaged");
}

}  // namespace jackal_aic
