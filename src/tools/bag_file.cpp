#include "bag_file.hpp"

#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
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

std::string unreadableBag(const std::string& path, const std::exception& error) {
  constexpr std::size_t kLongest = 200;  // the library quotes a damaged file at length
  const bool memory = dynamic_cast<const std::bad_alloc*>(&error) != nullptr;
  std::string reason = memory ? "a length in it is beyond all memory" : shortened(error.what(), kLongest);
  while (!reason.empty() && reason.back() == ' ') reason.pop_back();
  return path + ": cannot be read as a bag: " + reason;
}

}  // namespace jackal_aic
