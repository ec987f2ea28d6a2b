#include "tool_files.hpp"

#include "jackal_aic/config/yaml_parameters.hpp"
#include "node_parameters.hpp"
#include "plant_conversion.hpp"

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
    const auto* gains = std::get_if<ControllerParameters>(&node.controller);
    if (gains == nullptr) throw ParameterError("controller.*: missing; expected gains of the thesis' structure");
    return ControllerFile{*gains, node.geometry, node.gate.limits};
  });
}

bool describesPredictive(const std::string& path) {
  ParameterMap map;
  addYamlFile(path, map);
  return map.hasSection("predictive");
}

PredictiveFile readPredictiveFile(const std::string& path) {
  return readFile(path, [](ParameterMap& map) {
    const NodeParameters node = readConfiguration(map);
    const auto* gains = std::get_if<PredictiveParameters>(&node.controller);
    if (gains == nullptr) throw ParameterError("predictive.*: missing; expected gains of the predictive structure");
    return PredictiveFile{*gains, node.plant_model};
  });
}

PlantFile readPlantFile(const std::string& path) {
  return readFile(path, [](ParameterMap& map) {
    if (map.hasSection("plant_model")) {
      const auto model = readParameters<PlantModel>(map, "plant_model");
      return PlantFile{model, sim::simulatedRobot(model)};
    }
    if (!map.hasSection("plant")) throw ParameterError("has neither plant_model.* nor plant.*: not a plant file");
    const auto simulation = readParameters<sim::PlantParameters>(map, "plant");
    return PlantFile{sim::linearModel(simulation), simulation};
  });
}

}  // namespace jackal_aic
