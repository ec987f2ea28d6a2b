#include "parameters/node_parameters.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "jackal_aic/certificate/certificate.hpp"
#include "jackal_aic/config/text.hpp"
#include "jackal_aic/config/urdf_geometry.hpp"
#include "jackal_aic/config/yaml.hpp"

namespace jackal_aic {
namespace {

/// Fills in the geometry from the URDF where the YAML has none.
void completeGeometry(bool radius_given, bool track_given, const std::function<std::string()>& robot_description,
                      NodeParameters& parameters) {
  if (radius_given && track_given) return;
  const std::string urdf = robot_description();
  if (urdf.empty()) {
    throw ParameterError(std::string(radius_given ? "robot.effective_track" : "robot.wheel_radius") +
                         ": not given, and robot_description is not set to take it from");
  }
  const UrdfGeometry wheels = readUrdfGeometry(urdf, parameters.robot.left_wheel_joints,
                                               parameters.robot.right_wheel_joints, parameters.robot.base_frame);
  if (!radius_given) parameters.geometry.wheel_radius = wheels.wheel_radius;
  if (!track_given) parameters.geometry.effective_track = wheels.track * parameters.robot.track_multiplier;
  try {
    requireInRange(parameters.geometry, "robot");  // for example a URDF in millimetres
  } catch (const ParameterError& error) {
    throw ParameterError(std::string("URDF: ") + error.what());
  }
}

decltype(DriveParameters::controller) readGains(ParameterMap& map, const SensorNoise& sensors) {
  std::vector<std::string> given;
  for (const char* section : {"controller", "predictive", "diff_drive"}) {
    if (map.hasSection(section)) given.emplace_back(section);
  }
  if (given.empty()) {
    throw ParameterError(
        "controller.* or predictive.*: missing; load a preset (config/predictive.yaml, improved.yaml, ...)");
  }
  if (given.size() > 1) {
    throw ParameterError(given.front() + ".* and " + given.back() +
                         ".*: both given, but one controller runs; load one preset");
  }
  if (given[0] == "predictive") {
    PredictiveParameters defaults;
    static_cast<SensorNoise&>(defaults) = sensors;
    return readParameters(map, "predictive", defaults);
  }
  if (given[0] == "diff_drive") return readParameters<DifferentialDriveParameters>(map, "diff_drive");
  return readParameters<ControllerParameters>(map, "controller");
}

FaultParameters readFaults(ParameterMap& map, const SensorNoise& sensors) {
  FaultParameters defaults;
  static_cast<SensorNoise&>(defaults) = sensors;
  return readParameters(map, "faults", defaults);
}

/// The file of the learned model.
std::string readSlipFile(ParameterMap& map) {
  std::string path;
  ParameterReader(map, "slip").field("file", path, Presence::optional);
  if (path.empty() || path.front() == '/') return path;
  throw ParameterError("slip.file = " + quoted(path) + ": must be an absolute path");
}

/// tf2 names frames without the leading slash of older configurations.
void requireFrame(const char* key, const std::string& frame) {
  if (frame.find_first_not_of('/') != std::string::npos) return;
  throw ParameterError(std::string(key) + " = " + quoted(frame) + ": must be the name of a frame");
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

}  // namespace

LinearLoop closedLoop(const NodeParameters& parameters, const PlantModel& robot) {
  if (const auto* thesis = std::get_if<ControllerParameters>(&parameters.controller)) {
    return LinearLoop(*thesis, parameters.geometry, robot);
  }
  const auto* predictive = std::get_if<PredictiveParameters>(&parameters.controller);
  if (predictive == nullptr) {
    throw ParameterError("controller.* and predictive.*: missing; expected gains of one of them");
  }
  if (parameters.plant_model) return LinearLoop(*predictive, drivenModel(*parameters.plant_model), robot);
  throw ParameterError(
      "plant_model.*: missing; the predictive controller needs the drive train (config/plant_model.yaml, or by "
      "identify)");
}

void requireStable(const NodeParameters& parameters) {
  const auto* thesis = std::get_if<ControllerParameters>(&parameters.controller);
  const auto* predictive = std::get_if<PredictiveParameters>(&parameters.controller);
  if (thesis != nullptr) validate(*thesis, parameters.geometry);
  if (predictive != nullptr) validate(*predictive);
  if (predictive == nullptr && (thesis == nullptr || !parameters.plant_model)) return;
  requireStable(closedLoop(parameters, drivenModel(parameters.plant_model.value_or(PlantModel{}))));
}

std::string gainsText(const Gains& gains) {
  if (const auto* thesis = std::get_if<ControllerParameters>(&gains)) return yamlBlock("controller", *thesis);
  const auto& predictive = std::get<PredictiveParameters>(gains);
  return yamlBlock("predictive", predictive) + yamlBlock<SensorNoise>("sensors", predictive);
}

Gains readGainsText(const std::string& text) {
  ParameterMap map;
  addYamlText(text, "gains", map);
  const auto gains = readConfiguration(map).controller;
  map.refuseUnknown();
  if (const auto* thesis = std::get_if<ControllerParameters>(&gains)) return *thesis;
  if (const auto* predictive = std::get_if<PredictiveParameters>(&gains)) return *predictive;
  throw ParameterError("gains: diff_drive.* cannot be changed while it drives");
}

std::string configurationText(const NodeParameters& parameters) {
  std::string text;
  if (const auto* thesis = std::get_if<ControllerParameters>(&parameters.controller)) text = gainsText(*thesis);
  const auto* open_loop = std::get_if<DifferentialDriveParameters>(&parameters.controller);
  if (open_loop != nullptr) text = yamlBlock("diff_drive", *open_loop);
  if (const auto* predictive = std::get_if<PredictiveParameters>(&parameters.controller)) {
    text = gainsText(*predictive);
  } else if (parameters.faults) {
    text += yamlBlock<SensorNoise>("sensors", *parameters.faults);
  }
  std::vector<Field> robot = fieldsOf(parameters.geometry);
  for (Field& field : fieldsOf(parameters.robot)) robot.push_back(std::move(field));
  text += yamlBlock("robot", robot);
  if (parameters.plant_model) {
    std::vector<Field> model = fieldsOf(*parameters.plant_model);
    for (Field& field : model) {
      if (field.name == "robot") field.value = parameters.robot_name;
    }
    text += yamlBlock("plant_model", model);
  }
  const GateParameters& gate = parameters.gate;
  text += yamlBlock("odometry", parameters.odometry) + yamlBlock("limits", gate.limits) +
          yamlBlock("deadlines", gate.deadlines) + yamlBlock("brake", gate.brake) +
          yamlBlock("plausibility", gate.plausibility) + yamlBlock("on_loss", parameters.on_loss);
  if (parameters.faults) text += yamlBlock("faults", *parameters.faults);
  FieldList others;
  NodeOptions options = parameters;
  RestartPolicy restart_after_stop = gate.restart_after_stop;
  others.field("restart_after_stop", restart_after_stop, kRestartPolicyNames, Presence::optional);
  describeFields(others, options);
  for (const Field& field : others.fields) {
    const auto* words = std::get_if<std::string>(&field.value);
    if (words != nullptr && words->empty()) continue;  // not given; no number means that
    text += field.name + ": " + yamlValue(field.value) + "\n";
  }
  return text;
}

std::string describeRobot(const NodeParameters& parameters) {
  if (!parameters.plant_model) return "No plant model: no fault detection by prediction";
  const PlantModel& model = *parameters.plant_model;
  std::string text = fmt::format(
      "Plant model: {}{}, {}dead time {:g} s, lag {:g} s, gain {:g}, offset {:g} rad/s, acceleration limit {:g} m/s^2",
      parameters.robot_name.empty() ? "robot without a name" : shortened(parameters.robot_name),
      model.on_box ? ", wheels in the air" : "", model.identified ? "" : "assumed ", model.dead_time, model.lag,
      model.gain, model.offset, model.acceleration_limit);
  if (!model.identified) text += ". Assumed plant model: fault thresholds relaxed. Run identify.launch";
  return text;
}

NodeParameters readConfiguration(ParameterMap& map, NodeParameters parameters) {
  const auto sensors = readParameters<SensorNoise>(map, "sensors");
  parameters.controller = readGains(map, sensors);
  parameters.geometry = readParameters(map, "robot", parameters.geometry);
  parameters.robot = readParameters(map, "robot", parameters.robot);
  parameters.odometry = readParameters(map, "odometry", parameters.odometry);
  parameters.gate = readGateParameters(map, parameters.gate);
  parameters.on_loss = readParameters(map, "on_loss", parameters.on_loss);
  parameters.faults = readFaults(map, sensors);
  static_cast<NodeOptions&>(parameters) = readParameters<NodeOptions>(map, "", parameters);
  parameters.motors_shared = parameters.output == OutputMode::twist;
  if (map.hasSection("plant_model")) {
    parameters.plant_model = readPlantModel(map, parameters.plant_model.value_or(PlantModel{}));
  }
  requireFrame("robot.base_frame", parameters.robot.base_frame);
  requireFrame("odometry.frame", parameters.odometry.frame);
  parameters.robot_name = robotName(map);
  parameters.slip_file = readSlipFile(map);
  return parameters;
}

NodeParameters readNodeParameters(ParameterMap map, const std::function<std::string()>& robot_description) {
  NodeParameters parameters = readConfiguration(map);
  if (map.hasSection("plant")) {
    throw ParameterError(
        "plant: parameters of a simulated robot; the controller needs a plant model, as identify writes: "
        "plant_model:=FILE");
  }
  map.refuseUnknown();

  if (const auto* drive = std::get_if<DifferentialDriveParameters>(&parameters.controller)) {
    parameters.geometry = drive->geometry();  // assumed by the baseline
  } else {
    completeGeometry(map.has("robot.wheel_radius"), map.has("robot.effective_track"), robot_description, parameters);
  }
  requireStable(parameters);
  return parameters;
}

NodeParameters readControllerFile(const std::string& path) {
  return readFile(path, [](ParameterMap& map) { return readConfiguration(map); });
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
