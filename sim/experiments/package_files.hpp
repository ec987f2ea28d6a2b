#pragma once

/// @file
/// Where the data files of the package are (config, sim/urdf, sim/thesis, ...), without asking ROS.

#include <filesystem>
#include <string>

namespace jackal_aic::sim {

/// The share directory of the package: its source directory or its installed copy.
class PackageFiles {
 public:
  /// @param share directory to use; if empty, the first that holds the package's files of: the environment variable
  /// JACKAL_AIC_SHARE, share/jackal_aic of the install space this program runs from, the source directory of the build.
  /// @throws ParameterError if there is none, or the given one does not hold them.
  explicit PackageFiles(const std::string& share = "");

  /// Path of a file of the package, e.g. "config/standard.yaml". @throws ParameterError if it does not exist.
  std::string path(const std::string& relative) const;

 private:
  std::filesystem::path share_;
};

/// Whole text of a file. @throws ParameterError if it cannot be read.
std::string readText(const std::string& path);

/// Makes a directory for results, and those above it, unless it is there. @throws ParameterError, in the words of the
/// option --out, if it cannot be made.
void createDirectory(const std::string& directory);

}  // namespace jackal_aic::sim
