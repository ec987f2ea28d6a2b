#pragma once

/// @file
/// ParameterMap from a YAML file, for everything that runs without a ROS parameter server.

#include <string>

#include "jackal_aic/parameter_map.hpp"

namespace jackal_aic {

/// Adds the keys of a YAML file to a map, nested keys joined by dots; later files replace earlier values.
/// @throws ParameterError if the file cannot be read, is not YAML, or holds something other than scalars and flat
/// lists.
void addYamlFile(const std::string& path, ParameterMap& map);

/// As addYamlFile, from YAML text; name stands for the file in messages.
void addYamlText(const std::string& text, const std::string& name, ParameterMap& map);

}  // namespace jackal_aic
