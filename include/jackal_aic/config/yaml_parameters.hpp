#pragma once

/// @file
/// ParameterMap from a YAML file, for programs without a ROS parameter server.

#include <string>

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic {

/// Adds the keys of a YAML file to a map, nested keys joined by dots; later files replace earlier values. A quoted
/// scalar is a text, in a list too.
/// @throws ParameterError, one line, if the file cannot be read, has more than 1 MiB or is not YAML. Also for anything
/// but scalars and flat lists of numbers or texts, a repeated key, one of more than 1000
/// characters, an empty map or a second document.
void addYamlFile(const std::string& path, ParameterMap& map);

/// As addYamlFile, from YAML text; messages show `name` as the file.
void addYamlText(const std::string& text, const std::string& name, ParameterMap& map);

/// Sets one key, replacing any value, from the text of a YAML value: "0.5", "[a, b]", "'2'".
/// @throws ParameterError as addYamlText().
void setFromText(const std::string& key, const std::string& text, ParameterMap& map);

}  // namespace jackal_aic
