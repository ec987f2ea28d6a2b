#pragma once

/// @file
/// The checkout that is tested, and its files.

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "jackal_aic/config/yaml.hpp"

namespace jackal_aic {

/// Root of the checkout.
inline const std::filesystem::path kRoot = JACKAL_AIC_SOURCE_DIR;

/// Whole text of a file. @param path in the checkout ("config/plant.yaml"), or absolute. @throws std::runtime_error if
/// it cannot be read.
inline std::string textOf(const std::filesystem::path& path) {
  std::ifstream file(kRoot / path);
  if (!file) throw std::runtime_error((kRoot / path).string() + ": cannot be read");
  return {std::istreambuf_iterator<char>(file), {}};
}

/// URDF of the simulated Jackal.
inline std::string jackalUrdf() { return textOf("sim/urdf/jackal.urdf"); }

/// Parameters of files of config/, by their names without the ending.
inline ParameterMap shipped(const std::vector<std::string>& files) {
  ParameterMap map;
  for (const std::string& file : files) addYamlText(textOf("config/" + file + ".yaml"), file, map);
  return map;
}

}  // namespace jackal_aic
