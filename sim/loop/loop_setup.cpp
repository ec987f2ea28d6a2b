#include "loop_setup.hpp"

#include <algorithm>
#include <filesystem>
#include <limits>

#include "jackal_aic/config/text.hpp"
#include "jackal_aic/config/yaml.hpp"
#include "parameters/node_parameters.hpp"
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

void addController(const std::string& name, ParameterMap& map) {
  if (isFile(name)) {
    addYamlFile(name, map);
    return;
  }
  requireKnown("controller", name, {kDifferentialDrive, "standard", "improved", "tuned", "predictive"});
  map.add(configuration(name));
}

/// @return the simulated robot of a plant's file, before overrides.
PlantParameters addPlant(const std::string& name, ParameterMap& map) {
  if (isFile(name)) {
    ParameterMap file;
    addYamlFile(name, file);
    if (!file.hasSection("plant") && !file.hasSection("plant_model")) {
      throw ParameterError(name + ": has neither plant_model.* nor plant.*: not a plant file");
    }
    map.add(file);
    return readSimulatedRobot(file);
  }
  requireKnown("plant", name, {"box", "ground", "real"});
  map.add(configuration(name == "ground" ? "plant" : "plant_" + name));
  return {};
}

/// The thesis' robot had no limit on the acceleration of the command. So its runs, and the comparisons, have none
/// either, unless an override sets one (limits.linear_acceleration, 20 m/s^2 on the robot).
LimitParameters thesisLimits() {
  LimitParameters limits;
  limits.linear_acceleration = limits.angular_acceleration = 0.0;
  return limits;
}

/// Settings of a drive loop that always drives: without deadlines, watchdog and fault detection. It tolerates every
/// loss that the controller can handle.
DriveParameters uninterrupted() {
  DriveParameters parameters;
  parameters.gate.deadlines = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  parameters.gate.plausibility.speed_factor = std::numeric_limits<double>::infinity();
  parameters.on_loss = {LossAction::drive, LossAction::drive, LossAction::drive,
                        std::numeric_limits<double>::infinity()};
  parameters.faults.reset();
  return parameters;
}

/// Limits beyond every command.
LimitParameters unlimited() {
  LimitParameters limits;
  limits.linear_speed = limits.angular_speed = limits.wheel_speed = 1e6;
  limits.linear_acceleration = limits.angular_acceleration = 0.0;
  return limits;
}

/// Parameters from the configuration of a node, with the thesis' limits and the right model of the drive train unless
/// keys change them. @param nominal drive train of the plant's file.
NodeParameters readNode(ParameterMap& map, const PlantModel& nominal) {
  if (!map.has("plant_model.dead_time")) map.set("plant_model.dead_time", nominal.dead_time);
  if (!map.has("plant_model.lag")) map.set("plant_model.lag", nominal.lag);
  NodeParameters defaults;
  defaults.gate.limits = thesisLimits();
  defaults.plant_model = nominal;
  return readConfiguration(map, defaults);
}

/// A file of a whole node may have keys that its controller ignores; an override without effect is an error.
void refuseUnheeded(const ParameterMap& file, const Overrides& overrides) {
  std::vector<std::string> unheeded;
  for (const char* structure : {"controller", "predictive", kDifferentialDrive}) {
    if (!file.hasSection(structure)) unheeded.emplace_back(structure);
  }
  if (file.hasSection(kDifferentialDrive)) unheeded.insert(unheeded.end(), {"robot", "limits", "plant_model"});
  for (const auto& [key, value] : overrides) {
    if (!contains(unheeded, key.substr(0, key.find('.')))) continue;
    throw ParameterError(key + " = " + value + ": unknown key for this controller");
  }
}

}  // namespace

void requireKnown(const char* what, const std::string& name, const std::vector<std::string>& names) {
  if (contains(names, name)) return;
  std::string list;
  for (const auto& known : names) list += known + ", ";
  throw ParameterError(std::string(what) + " = " + quoted(name) + ": unknown; known: " + list + "or a file NAME.yaml");
}

LoopSetup loadSetup(const std::string& controller, const std::string& plant, const Overrides& overrides) {
  ParameterMap map;
  addController(controller, map);
  const PlantParameters robot = addPlant(plant, map);
  ParameterMap nominal = map;
  refuseUnheeded(map, overrides);
  for (const auto& [key, value] : overrides) setFromText(key, value, map);

  LoopSetup setup;
  setup.plant = readParameters<PlantParameters>(map, "plant", robot);
  setup.loop = readParameters<LoopParameters>(map, "loop");
  PlantModel told = linearModel(readParameters<PlantParameters>(nominal, "plant", robot));
  if (!isFile(plant)) told.offset = 0.0;  // the flaws of `real`, its offset included, are unknown to controllers
  const NodeParameters node = readNode(map, told);
  DriveParameters& drive = setup.drive = uninterrupted();  // no deadlines, because nothing is late or fails here
  drive.controller = node.controller;
  if (const auto* gains = std::get_if<DifferentialDriveParameters>(&node.controller)) {
    drive.geometry = gains->geometry();
    drive.gate.limits = unlimited();  // the baseline keeps its own
  } else {
    drive.geometry = node.geometry;
    drive.gate.limits = node.gate.limits;
    drive.plant_model = node.plant_model;
  }
  map.refuseUnknown();
  setup.urdf = robotUrdf();
  return setup;
}

PlantModel monitorModel(const std::string& plant_name) {
  PlantModel model = linearModel(loadSetup(kDifferentialDrive, plant_name, {}).plant);
  model.offset = 0.0;  // as in loadSetup()
  ParameterMap map = configuration("plant_model");
  if (!model.on_box) model.effective_track = readPlantModel(map).effective_track;
  return model;
}

DriveLoop makeLoop(const LoopSetup& setup, std::unique_ptr<VelocityController> controller) {
  if (!controller) controller = makeController(setup.drive, Divergence::allowed);
  DriveParameters drive = setup.drive;
  if (setup.monitor) {
    drive.faults = FaultParameters{};
    drive.plant_model = setup.monitor;
    drive.open_loop_monitored = true;
  }
  return DriveLoop(drive, std::move(controller));
}

}  // namespace jackal_aic::sim
