#include "controller_file.hpp"

#include "jackal_aic/config/yaml_parameters.hpp"
#include "node_parameters.hpp"

namespace jackal_aic {
namespace {

/// Runs a reader of the file's keys; its errors name the file.
template <class Read>
auto readFile(const std::string& path, const Read& read) {
  ParameterMap map;
  addYamlFile(path, map);
  try {
    auto result = read(map);
    map.refuseUnknown();
    return result;
  } catch (const ParameterError& error) {
    throw ParameterError(path + ": " + error.what());
  }
}

}  // namespace

ControllerFile readControllerFile(const std::string& path) {
  return readFile(path, [](ParameterMap& map) {
    const NodeParameters node = readConfiguration(map);
    ControllerFile file{{}, node.geometry, node.gate.limits, node.plant_model};
    if (const auto* gains = std::get_if<ControllerParameters>(&node.controller)) {
      file.controller = *gains;
    } else if (const auto* predictive = std::get_if<PredictiveParameters>(&node.controller)) {
      file.controller = *predictive;
    } else {
      throw ParameterError("controller.* and predictive.*: missing; expected gains of one of them");
    }
    return file;
  });
}

PlantModel readPlantModelFile(const std::string& path) {
  return readFile(path, [](ParameterMap& map) {
    if (!map.hasSection("plant_model")) {
      throw ParameterError("has no plant_model.*: not a plant model, as identify writes it");
    }
    return readPlantModel(map);
  });
}

}  // namespace jackal_aic
