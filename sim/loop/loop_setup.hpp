#pragma once

/// @file
/// Parameters of one closed loop, from names and overrides.

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "closed_loop.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "package_files.hpp"
#include "plant_parameters.hpp"

namespace jackal_aic::sim {

/// Name of the stock differential drive, which sends the wheel speeds of its kinematics and uses no measurement.
inline constexpr const char* kDifferentialDrive = "diff_drive";

/// Parameters set from text, in order: ("controller.tau", "0.01").
using Overrides = std::vector<std::pair<std::string, std::string>>;

/// Parameters of one closed loop.
struct LoopSetup {
  std::string plant_name;  ///< as given
  DriveParameters drive;   ///< settings of the drive loop
  PlantParameters plant;   ///< settings of the plant
  LoopParameters loop;     ///< timing of both
  std::string urdf;        ///< text of the robot's URDF
  /// Makes a controller other than that of `drive`; else empty.
  std::function<std::unique_ptr<VelocityController>()> structure = {};
};

/// Names of controllers that loadSetup() takes; it also takes a file.
const std::vector<std::string>& controllerNames();

/// Names of plants that loadSetup() takes; it also takes a file.
const std::vector<std::string>& plantNames();

/// Requires a known name. @param what kind of name, for the message, which also mentions a file.
/// @throws ParameterError with the names, if it is not.
void requireKnown(const char* what, const std::string& name, const std::vector<std::string>& names);

/// Reads the parameters of a loop.
/// @param controller a preset (config/NAME.yaml) or a YAML file with the keys of a preset; a file with
/// the key
///        diff_drive is the differential drive.
/// @param plant "box", "ground" (the calibrated plants of config/), "real" (config/plant_real.yaml) or a YAML file with
/// the key plant. The controller's model of the drive train is that of the plant's file, without overrides of the plant
/// and, for a named plant, without its offset. Keys plant_model.* change the model.
/// @throws ParameterError for an unknown name (with the list of names), key, type or value.
LoopSetup loadSetup(const PackageFiles& files, const std::string& controller, const std::string& plant,
                    const Overrides& overrides);

/// Acceleration of the thesis' differential drive [m/s^2], implied by its Table 3-1. On the same ground the active
/// inference controller accelerates from 0.1 to 0.9 m/s in 0.45 s, so the motors reach 1.8 m/s^2. The differential
/// drive needs 0.62 s, and 0.35 s from 0.05 to 0.45 m/s: 1.3 and 1.1 m/s^2. Its commands are limited to less than the
/// 20 m/s^2 of the published settings of a Jackal (config/diff_drive.yaml). The value has the least error over Table
/// 3-1b, of 1.0 to 1.6 in steps of 0.1. The 0.1 m/s row contradicts it: 0.04 s are 2 m/s^2.
inline constexpr double kThesisDriveAcceleration = 1.2;

/// As loadSetup(), with the controllers of the thesis: controller.printed for its own, and kThesisDriveAcceleration for
/// the named differential drive.
LoopSetup loadPrintedSetup(const PackageFiles& files, const std::string& controller, const std::string& plant,
                           const Overrides& overrides);

/// The drive loop of a setup. A belief update that diverges is run as it is, because the thesis shows such cases.
/// @throws ParameterError if its parameters contradict each other.
DriveLoop makeLoop(const DriveParameters& parameters);
DriveLoop makeLoop(const LoopSetup& setup);  ///< with the controller of the setup

}  // namespace jackal_aic::sim
