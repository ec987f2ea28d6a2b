#include "bag_file.hpp"

#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <iostream>
#include <new>

#include "jackal_aic/config/text.hpp"

namespace jackal_aic {

std::string prepareToRead(const std::string& path) {
  struct stat file {};
  if (stat(path.c_str(), &file) != 0) return "";
  if (!S_ISREG(file.st_mode)) {
    return path + ": cannot be read as a bag: it is " + (S_ISDIR(file.st_mode) ? "a directory" : "no file");
  }
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // whose shadow memory exceeds any limit
  rlimit limit{};
  getrlimit(RLIMIT_AS, &limit);
  limit.rlim_cur = std::min(limit.rlim_max, (rlim_t{2} << 30) + 4 * static_cast<rlim_t>(file.st_size));
  setrlimit(RLIMIT_AS, &limit);
#endif
  return "";
}

int inChildProcess(const std::string& program, const std::function<int()>& work) {
  constexpr int kDamaged = 2;
  std::fflush(nullptr);  // else both processes would write the buffered text
  const pid_t child = fork();
  if (child <= 0) {
    const int status = work();
    if (child < 0) return status;
    std::cout.flush();
    std::fflush(nullptr);
    _exit(status);
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status)) return WEXITSTATUS(status);
  std::fprintf(stderr, "%s: the bag cannot be read: it is damaged\n", program.c_str());
  return kDamaged;
}

std::string unreadableBag(const std::string& path, const std::exception& error) {
  constexpr std::size_t kLongest = 200;  // the library quotes a damaged file at length
  const bool memory = dynamic_cast<const std::bad_alloc*>(&error) != nullptr;
  std::string reason = memory ? "a length in it is beyond all memory" : shortened(error.what(), kLongest);
  while (!reason.empty() && reason.back() == ' ') reason.pop_back();
  return path + ": cannot be read as a bag: " + reason;
}

}  // namespace jackal_aic
