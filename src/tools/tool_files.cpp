#include "tool_files.hpp"

#include <algorithm>

#include "jackal_aic/config/yaml_parameters.hpp"
#include "node_keys.hpp"
#include "plant_conversion.hpp"

namespace jackal_aic {
namespace {

bool hasPrefix(const ParameterMap& map, const std::string& prefix) {
  const auto keys = map.keys();
  return std::any_of(keys.begin(), keys.end(),
                     [&](const std::string& key) { return key.compare(0, prefix.size(), prefix) == 0; });
}

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

/// Reads what a node's configuration has beside gains, geometry and drive train, so that only unknown keys are left.
LimitParameters readLimits(ParameterMap& map) {
  readRestOfNode(map);
  return readGateParameters(map).limits;
}

}  // namespace

ControllerFile readControllerFile(const std::string& path) {
  return readFile(path, [](ParameterMap& map) {
    ControllerFile file{readParameters<ControllerParameters>(map, "controller"),
                        readParameters<GeometryParameters>(map, "robot"), readLimits(map)};
    if (hasPrefix(map, "plant_model.")) readParameters<PlantModel>(map, "plant_model");
    return file;
  });
}

bool describesPredictive(const std::string& path) {
  ParameterMap map;
  addYamlFile(path, map);
  return hasPrefix(map, "predictive.");
}

PredictiveFile readPredictiveFile(const std::string& path) {
  return readFile(path, [](ParameterMap& map) {
    PredictiveFile file{readParameters<PredictiveParameters>(map, "predictive"), std::nullopt};
    if (hasPrefix(map, "plant_model.")) file.model = readParameters<PlantModel>(map, "plant_model");
    readParameters<GeometryParameters>(map, "robot");
    readLimits(map);
    return file;
  });
}

PlantFile readPlantFile(const std::string& path) {
  return readFile(path, [](ParameterMap& map) {
    if (hasPrefix(map, "plant_model.")) {
      const auto model = readParameters<PlantModel>(map, "plant_model");
      return PlantFile{model, sim::simulatedRobot(model)};
    }
    if (!hasPrefix(map, "plant.")) throw ParameterError("has neither plant_model.* nor plant.*: not a plant file");
    const auto simulation = readParameters<sim::PlantParameters>(map, "plant");
    return PlantFile{sim::linearModel(simulation), simulation};
  });
}

}  // namespace jackal_aic
