#include "campaign_parameters.hpp"

#include <regex>

#include "jackal_aic/config/yaml_parameters.hpp"
#include "plant_parameters.hpp"

namespace jackal_aic::sim {

std::vector<Scenario> selectedScenarios(const CampaignParameters& parameters) {
  std::vector<Scenario> selected;
  try {
    const std::regex pattern(parameters.select);
    for (Scenario& scenario : readScenarios(parameters.scenarios)) {
      if (!std::regex_search(scenario.name, pattern) || scenario.own_launch != parameters.own_launch) continue;
      if ((parameters.core && !scenario.core) || (parameters.real && !scenario.real)) continue;
      selected.push_back(std::move(scenario));
    }
  } catch (const std::regex_error& error) {
    throw ParameterError("select = '" + parameters.select + "': no regular expression: " + error.what());
  }
  if (selected.empty()) throw ParameterError("select = '" + parameters.select + "': matches no scenario");
  return selected;
}

CampaignLimits campaignLimits(const CampaignParameters& parameters) {
  ParameterMap robot, plant;
  addYamlFile(parameters.robot, robot);
  addYamlFile(parameters.plant, plant);
  CampaignLimits limits;
  limits.gate = readGateParameters(robot);
  limits.geometry = readParameters<GeometryParameters>(robot, "robot");
  const auto model = readParameters<PlantParameters>(plant, "plant");
  limits.robot_dead_time = model.dead_time;
  limits.robot_acceleration = model.acceleration_limit;
  return limits;
}

}  // namespace jackal_aic::sim
