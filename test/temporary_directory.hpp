#pragma once

/// @file
/// A directory for the files of a test.

#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace jackal_aic {

/// A new directory that is gone with the object.
class TemporaryDirectory {
 public:
  TemporaryDirectory() : path_((std::filesystem::temp_directory_path() / "jackal_aic_XXXXXX").string()) {
    if (mkdtemp(path_.data()) == nullptr) throw std::runtime_error("no directory for the test");
  }
  ~TemporaryDirectory() { std::filesystem::remove_all(path_); }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;

  /// Writes a file in it; returns its path.
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name)) << text;
    return path(name);
  }

  const std::string& path() const { return path_; }                               ///< of the directory
  std::string path(const std::string& name) const { return path_ + "/" + name; }  ///< of a file in it

 private:
  std::string path_;
};

}  // namespace jackal_aic
