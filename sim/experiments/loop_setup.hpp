#pragma once

/// @file
/// From names and overrides to the parameters of one closed loop.

#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "closed_loop.hpp"
#include "differential_drive.hpp"
#include "package_files.hpp"
#include "plant_parameters.hpp"
#include "timed_controller.hpp"

namespace jackal_aic::sim {

/// Parameters set from text, in order: ("controller.tau", "0.01").
using Overrides = std::vector<std::pair<std::string, std::string>>;

/// Everything one closed loop needs.
struct LoopSetup {
  std::string controller_name;                                                                  ///< as it was asked for
  std::string plant_name;                                                                       ///< as it was asked for
  std::variant<ActiveInferenceSetup, PredictiveSetup, DifferentialDriveParameters> controller;  ///< its settings
  PlantParameters plant;  ///< settings of the plant
  LoopParameters loop;    ///< how they are timed
  std::string urdf;       ///< text of the robot's URDF

  /// Wheel radius and effective track as the controller knows them.
  GeometryParameters geometry() const;
};

/// Names that loadSetup() takes for a controller beside a file.
const std::vector<std::string>& controllerNames();

/// Names that loadSetup() takes for a plant beside a file.
const std::vector<std::string>& plantNames();

/// Reads the parameters of a loop.
/// @param controller a preset (config/NAME.yaml) or a YAML file with the keys of a preset; a file with
/// the key
///        diff_drive is the differential drive.
/// @param plant "box", "ground" (the calibrated plants of config/) or a YAML file with the key plant.
/// The controller's model of the drive train is that of the plant's file, whatever the overrides make of the plant;
/// keys plant_model.* change the model.
/// @throws ParameterError for an unknown name (with the list of names), key, type or value.
LoopSetup loadSetup(const PackageFiles& files, const std::string& controller, const std::string& plant,
                    const Overrides& overrides);

/// As loadSetup(), with the thesis' controllers as it prints them: nothing tells the action what the motors can follow.
LoopSetup loadPrintedSetup(const PackageFiles& files, const std::string& controller, const std::string& plant,
                           const Overrides& overrides);

/// Gains, geometry and limits of an active inference controller alone, by the same rules. @throws ParameterError also
/// if the controller is the differential drive.
ActiveInferenceSetup loadActiveInference(const PackageFiles& files, const std::string& controller,
                                         const Overrides& overrides);

/// Builds the controller of a setup. @throws ParameterError if its parameters contradict each other.
std::unique_ptr<TimedController> makeController(const LoopSetup& setup);

/// "key=value" as an override. @throws ParameterError if there is no '=' or the key is empty.
std::pair<std::string, std::string> parseOverride(const std::string& text);

}  // namespace jackal_aic::sim
