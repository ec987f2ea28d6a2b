#pragma once

/// @file
/// Parameters from and to YAML, with the same meaning for every reader. In YAML 1.1, which rosparam and roslaunch use,
/// 1e+08 is a text; in YAML 1.2 and yaml-cpp it is a number.

#include <string>
#include <vector>

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

/// A number as YAML text with a point, and with a sign in the exponent (1000.0, 0.25, 1.0e+08). Every reader of YAML
/// 1.1, YAML 1.2 and JSON takes it for a floating-point number.
/// @param digits most significant digits; with 17 every number is read back as it was. @throws ParameterError if the
/// number is not finite, because the formats differ there.
std::string yamlNumber(double value, int digits = 17);

/// onOneLine() of a text as a quoted scalar of YAML and JSON.
std::string yamlQuoted(const std::string& text);

/// A value as YAML text: numbers as yamlNumber(), texts as yamlQuoted(), lists in brackets.
/// @throws ParameterError as yamlNumber().
std::string yamlValue(const ParameterValue& value);

/// Fields as the YAML block `prefix:`, each with its unit as a comment: the opposite of reading them from a file. All
/// fields are written, except empty texts, which readers refuse. @throws ParameterError as yamlNumber().
std::string yamlBlock(const std::string& prefix, const std::vector<Field>& fields);

/// The same of a parameter struct.
template <class S>
std::string yamlBlock(const std::string& prefix, const S& values) {
  return yamlBlock(prefix, fieldsOf(values));
}

}  // namespace jackal_aic
