#include "plant_file.hpp"

#include "jackal_aic/config/yaml_parameters.hpp"
#include "parameters/node_parameters.hpp"
#include "plant_conversion.hpp"

namespace jackal_aic {

PlantFile readPlantFile(const std::string& path) {
  ParameterMap map;
  addYamlFile(path, map);
  if (map.hasSection("plant_model")) {
    const PlantModel model = readPlantModelFile(path);
    return {model, sim::simulatedRobot(model)};
  }
  try {
    if (!map.hasSection("plant")) throw ParameterError("has neither plant_model.* nor plant.*: not a plant file");
    const auto simulation = readParameters<sim::PlantParameters>(map, "plant");
    map.refuseUnknown();
    return {sim::linearModel(simulation), simulation};
  } catch (const ParameterError& error) {
    throw ParameterError(path + ": " + error.what());
  }
}

}  // namespace jackal_aic
