#pragma once

/// @file
/// Small readers shared by the data files of the experiments.

#include <yaml-cpp/yaml.h>

#include <optional>
#include <string>

#include "loop_setup.hpp"

namespace jackal_aic::sim {

/// A number that may be absent.
inline std::optional<double> readOptional(const YAML::Node& node) {
  if (!node) return std::nullopt;
  return node.as<double>();
}

/// A map of scalars and lists as overrides with a prefix before each key; an absent node gives none.
inline Overrides readOverrides(const YAML::Node& node, const std::string& prefix) {
  Overrides overrides;
  for (const auto& entry : node) {
    overrides.emplace_back(prefix + entry.first.as<std::string>(), YAML::Dump(entry.second));
  }
  return overrides;
}

/// Calls read() and turns what yaml-cpp throws into a ParameterError that names the file.
template <class Read>
auto guardYaml(const std::string& path, Read read) {
  try {
    return read();
  } catch (const YAML::Exception& error) {
    throw ParameterError(path + ": " + error.what());
  }
}

}  // namespace jackal_aic::sim
