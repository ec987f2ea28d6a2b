#pragma once

/// @file
/// The data files of the package (config, sim/urdf, sim/thesis, ...), without ROS: those of share/jackal_aic in this
/// library's install space, else those of the source directory of the build.

#include <string>

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic::sim {

/// Path of a file of the package, e.g. "config/standard.yaml". @throws ParameterError if it does not exist.
std::string packageFile(const std::string& relative);

/// Keys of config/NAME.yaml, read once. @throws ParameterError if the file is missing or cannot be read.
const ParameterMap& configuration(const std::string& name);

/// Text of the robot's URDF (sim/urdf/jackal.urdf), read once. @throws ParameterError as configuration().
const std::string& robotUrdf();

}  // namespace jackal_aic::sim
