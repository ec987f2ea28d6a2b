#pragma once

/// @file
/// Parameters of one closed loop, from names and overrides.

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "jackal_aic/safety/drive_loop.hpp"
#include "package_files.hpp"
#include "plant_parameters.hpp"

namespace jackal_aic::sim {

/// Name of the stock differential drive, which sends the wheel speeds of its kinematics and uses no measurement.
inline constexpr const char* kDifferentialDrive = "diff_drive";

/// Parameters set from text, in order: ("controller.tau", "0.01").
using Overrides = std::vector<std::pair<std::string, std::string>>;

/// Phase of the loop's timers. YAML prefix `loop`.
struct LoopParameters {
  double phase = 0.0;  ///< age of the newest measurement when the action is computed [s], in steps of the plant
};

/// Lists the fields of LoopParameters with unit and range.
template <class Visitor>
void describeFields(Visitor& v, LoopParameters& p) {
  v.field("phase", p.phase, {0.0, 1.0}, "s", Presence::optional);
}

/// Parameters of one closed loop.
struct LoopSetup {
  DriveParameters drive;              ///< settings of the drive loop
  PlantParameters plant;              ///< settings of the plant
  LoopParameters loop;                ///< timing of both
  std::string urdf;                   ///< text of the robot's URDF
  std::optional<PlantModel> monitor;  ///< model of a fault detection, which may differ from the controller's; else none
};

/// Requires a known name. @param what kind of name, for the message, which also mentions a file.
/// @throws ParameterError with the names, if it is not.
void requireKnown(const char* what, const std::string& name, const std::vector<std::string>& names);

/// Reads the parameters of a loop.
/// @param controller a preset (config/NAME.yaml) or a YAML file with the keys of a preset; a file with the key
/// diff_drive is the differential drive.
/// @param plant "box", "ground" (the calibrated plants of config/), "real" (config/plant_real.yaml) or a YAML file with
/// the key plant. The controller's model of the drive train is that of the plant's file, without overrides of the plant
/// and, for a named plant, without its offset. Keys plant_model.* change the model.
/// @throws ParameterError for an unknown name (with the list of names), key, type or value.
LoopSetup loadSetup(const std::string& controller, const std::string& plant, const Overrides& overrides);

/// The model that a monitor of a plant uses: the drive train of the plant's file without offset and overrides, and the
/// effective track of config/plant_model.yaml.
PlantModel monitorModel(const std::string& plant_name);

/// The drive loop of a setup. A belief update that diverges is run as it is, because the thesis shows such cases.
/// @param controller one in place of that of the setup. @throws ParameterError if parameters contradict each other.
DriveLoop makeLoop(const LoopSetup& setup, std::unique_ptr<VelocityController> controller = nullptr);

}  // namespace jackal_aic::sim
