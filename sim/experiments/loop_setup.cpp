#include "loop_setup.hpp"

#include <algorithm>
#include <filesystem>

#include "jackal_aic/config/yaml_parameters.hpp"
#include "node_keys.hpp"
#include "plant_conversion.hpp"

namespace jackal_aic::sim {
namespace {

bool contains(const std::vector<std::string>& list, const std::string& word) {
  return std::find(list.begin(), list.end(), word) != list.end();
}

bool isFile(const std::string& name) {
  const std::filesystem::path path(name);
  return path.extension() == ".yaml" || path.extension() == ".yml";
}

[[noreturn]] void refuse(const char* what, const std::string& name, const std::vector<std::string>& names) {
  std::string list;
  for (const auto& known : names) list += known + ", ";
  throw ParameterError(std::string(what) + " = '" + name + "': unknown; known: " + list + "or a file NAME.yaml");
}

void addController(const PackageFiles& files, const std::string& name, ParameterMap& map) {
  if (isFile(name)) {
    addYamlFile(name, map);
  } else if (!contains(controllerNames(), name)) {
    refuse("controller", name, controllerNames());
  } else {
    addYamlFile(files.path("config/" + name + ".yaml"), map);
  }
}

void addPlant(const PackageFiles& files, const std::string& name, ParameterMap& map) {
  if (isFile(name)) {
    addYamlFile(name, map);
  } else if (contains(plantNames(), name)) {
    addYamlFile(files.path(name == "box" ? "config/plant_box.yaml" : "config/plant.yaml"), map);
  } else {
    refuse("plant", name, plantNames());
  }
}

bool hasPrefix(const ParameterMap& map, const std::string& prefix) {
  const auto keys = map.keys();
  return std::any_of(keys.begin(), keys.end(),
                     [&](const std::string& key) { return key.compare(0, prefix.size(), prefix) == 0; });
}

/// Limits of the drive gate. The thesis' robot had none on the acceleration of the command, so that its runs, and what
/// is compared with them, have none either unless one is asked for (limits.linear_acceleration, 20 m/s^2 on the robot).
LimitParameters readLimits(ParameterMap& map) {
  LimitParameters thesis;
  thesis.linear_acceleration = thesis.angular_acceleration = 0.0;
  return readParameters(map, "limits", thesis);
}

/// No limit that a command could meet.
LimitParameters unlimited() {
  LimitParameters limits;
  limits.linear_speed = limits.angular_speed = limits.wheel_speed = 1e6;
  limits.linear_acceleration = limits.angular_acceleration = 0.0;
  return limits;
}

/// The drive train as a controller believes it. @param nominal of the plant's file.
PlantModel readModel(const PlantModel& nominal, ParameterMap& map) {
  if (!map.has("plant_model.dead_time")) map.set("plant_model.dead_time", nominal.dead_time);
  if (!map.has("plant_model.lag")) map.set("plant_model.lag", nominal.lag);
  return readParameters(map, "plant_model", nominal);
}

/// Here nothing is late or fails, and there is no node; the file of a node may be given all the same.
void readUnused(ParameterMap& map) {
  readParameters<DeadlineParameters>(map, "deadlines");
  readParameters<BrakeParameters>(map, "brake");
  readParameters<PlausibilityParameters>(map, "plausibility");
  RestartPolicy restart{};
  ParameterReader(map, "").field("restart_after_stop", restart, kRestartPolicyNames, Presence::optional);
  readRestOfNode(map);
}

void apply(const Overrides& overrides, ParameterMap& map) {
  for (const auto& [key, value] : overrides) setFromText(key, value, map);
}

}  // namespace

const std::vector<std::string>& controllerNames() {
  static const std::vector<std::string> names{"diff_drive", "standard", "improved", "tuned", "predictive"};
  return names;
}

const std::vector<std::string>& plantNames() {
  static const std::vector<std::string> names{"box", "ground"};
  return names;
}

LoopSetup loadSetup(const PackageFiles& files, const std::string& controller, const std::string& plant,
                    const Overrides& overrides) {
  ParameterMap map;
  addController(files, controller, map);
  addPlant(files, plant, map);
  ParameterMap nominal = map;
  apply(overrides, map);

  LoopSetup setup;
  setup.controller_name = controller;
  setup.plant_name = plant;
  setup.plant = readParameters<PlantParameters>(map, "plant");
  setup.loop = readParameters<LoopParameters>(map, "loop");
  readUnused(map);
  const PlantModel model = linearModel(readParameters<PlantParameters>(nominal, "plant"));
  DriveParameters& drive = setup.drive = uninterrupted();
  if (hasPrefix(map, "diff_drive.")) {
    const auto gains = readParameters<DifferentialDriveParameters>(map, "diff_drive");
    drive.controller = gains;
    drive.geometry = gains.geometry();
    drive.gate.limits = unlimited();  // it keeps its own
  } else {
    drive.geometry = readParameters<GeometryParameters>(map, "robot");
    drive.gate.limits = readLimits(map);
    drive.plant_model = readModel(model, map);
    if (hasPrefix(map, "predictive.")) {
      drive.controller = readParameters<PredictiveParameters>(map, "predictive");
    } else {
      drive.controller = readParameters<ControllerParameters>(map, "controller");
    }
  }
  map.refuseUnknown();
  setup.urdf = readText(files.path("sim/urdf/jackal.urdf"));
  return setup;
}

LoopSetup loadPrintedSetup(const PackageFiles& files, const std::string& controller, const std::string& plant,
                           const Overrides& overrides) {
  LoopSetup setup = loadSetup(files, controller, plant, overrides);
  if (std::holds_alternative<ControllerParameters>(setup.drive.controller)) setup.drive.plant_model.reset();
  return setup;
}

ThesisSetup loadThesis(const PackageFiles& files, const std::string& controller, const Overrides& overrides) {
  ParameterMap map;
  addController(files, controller, map);
  apply(overrides, map);
  ThesisSetup setup{readParameters<ControllerParameters>(map, "controller"),
                    readParameters<GeometryParameters>(map, "robot")};
  readLimits(map);
  map.refuseUnknown();
  return setup;
}

DriveLoop makeLoop(const DriveParameters& parameters) {
  return DriveLoop(parameters, makeController(parameters, Divergence::allowed));
}

std::pair<std::string, std::string> parseOverride(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw ParameterError("set = '" + text + "': expected key=value, e.g. plant.dead_time=0.14");
  }
  return {text.substr(0, equals), text.substr(equals + 1)};
}

}  // namespace jackal_aic::sim
