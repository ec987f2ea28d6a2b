#pragma once

/// @file
/// The data files of the package (config, sim/urdf, sim/thesis, ...), without ROS.

#include <filesystem>
#include <map>
#include <string>

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic::sim {

/// The share directory of the package, its source directory or its installed copy, and the files of the closed loops,
/// each read once.
class PackageFiles {
 public:
  /// Takes share/jackal_aic of this library's install space, else the source directory of the build.
  /// @throws ParameterError if a file is missing or cannot be read.
  PackageFiles();

  /// Keys of a preset, plant or plant model of config/, by the name of its file without ".yaml": "standard", "plant",
  /// "plant_box", "plant_model", "jackal_model". @throws ParameterError without such a configuration.
  const ParameterMap& configuration(const std::string& name) const;

  /// Text of the robot's URDF (sim/urdf/jackal.urdf).
  const std::string& urdf() const { return urdf_; }

  /// Path of a file of the package, e.g. "config/standard.yaml". @throws ParameterError if it does not exist.
  std::string path(const std::string& relative) const;

 private:
  std::filesystem::path share_;
  std::map<std::string, ParameterMap> configurations_;
  std::string urdf_;
};

}  // namespace jackal_aic::sim
