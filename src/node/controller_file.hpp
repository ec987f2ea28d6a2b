#pragma once

/// @file
/// The YAML files of a controller and of a plant model, as the command line tools read them; no ROS.

#include <optional>
#include <string>
#include <variant>

#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"
#include "jackal_aic/safety/gate_parameters.hpp"

namespace jackal_aic {

/// Gains of a structure that can be certified.
using Gains = std::variant<ControllerParameters, PredictiveParameters>;

/// A controller as its file describes it.
struct ControllerFile {
  Gains controller;
  GeometryParameters geometry;
  LimitParameters limits;
  std::optional<PlantModel> model;  ///< drive train that a predictive controller believes in, if the file says
};

/// Reads a preset, or the whole configuration of a controller node; what is not about gains, geometry, limits or the
/// believed drive train is checked for unknown keys only. @throws ParameterError naming file and key, also for the
/// open-loop baseline, which has no gains.
ControllerFile readControllerFile(const std::string& path);

/// Reads a plant model (keys plant_model.*, as `identify` writes them). @throws ParameterError naming file and key,
/// also if the file has no such keys.
PlantModel readPlantModelFile(const std::string& path);

}  // namespace jackal_aic
