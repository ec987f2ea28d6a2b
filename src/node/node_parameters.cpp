#include "node_parameters.hpp"

#include <algorithm>

#include "jackal_aic/closed_loop_certificate.hpp"
#include "jackal_aic/urdf_geometry.hpp"

namespace jackal_aic {
namespace {

/// Fills in what the YAML leaves to the URDF.
void completeGeometry(bool radius_given, bool track_given, const std::function<std::string()>& robot_description,
                      NodeParameters& parameters) {
  if (radius_given && track_given) return;
  const std::string urdf = robot_description();
  if (urdf.empty()) {
    throw ParameterError(std::string(radius_given ? "robot.effective_track" : "robot.wheel_radius") +
                         ": not given, and robot_description is not set to take it from");
  }
  const UrdfGeometry wheels =
      readUrdfGeometry(urdf, parameters.robot.left_wheel_joints, parameters.robot.right_wheel_joints);
  if (!radius_given) parameters.geometry.wheel_radius = wheels.wheel_radius;
  if (!track_given) parameters.geometry.effective_track = wheels.track * parameters.robot.track_multiplier;
}

std::optional<PlantModel> readPlantModel(ParameterMap& map) {
  const auto keys = map.keys();
  const bool given = std::any_of(keys.begin(), keys.end(),
                                 [](const std::string& key) { return key.compare(0, 12, "plant_model.") == 0; });
  if (!given) return std::nullopt;
  return readParameters<PlantModel>(map, "plant_model");
}

}  // namespace

NodeParameters readNodeParameters(ParameterMap map, const std::function<std::string()>& robot_description) {
  for (const std::string& key : map.keys()) {
    if (key.rfind("predictive.", 0) == 0) {
      throw ParameterError(key +
                           ": the predictive controller runs only in the closed loop without ROS (experiments step)");
    }
  }
  NodeParameters parameters;
  parameters.controller = readParameters<ControllerParameters>(map, "controller");
  parameters.geometry = readParameters<GeometryParameters>(map, "robot");
  parameters.robot = readParameters<RobotNames>(map, "robot");
  parameters.limits = readParameters<LimitParameters>(map, "limits");
  parameters.deadlines = readParameters<DeadlineParameters>(map, "deadlines");
  ParameterReader(map, "").field("output", parameters.output, kOutputModeNames, Presence::optional);
  parameters.plant_model = readPlantModel(map);
  map.refuseUnknown();

  completeGeometry(map.has("robot.wheel_radius"), map.has("robot.effective_track"), robot_description, parameters);
  validate(parameters.controller, parameters.geometry);
  if (parameters.plant_model) requireStable(parameters.controller, parameters.geometry, *parameters.plant_model);
  return parameters;
}

}  // namespace jackal_aic
