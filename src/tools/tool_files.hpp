#pragma once

/// @file
/// The YAML files that the command line tools read.

#include <optional>
#include <string>
#include <variant>

#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"
#include "jackal_aic/safety/gate_parameters.hpp"
#include "plant_parameters.hpp"

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

/// A robot as its file describes it.
struct PlantFile {
  PlantModel model;                 ///< what a certificate sees
  sim::PlantParameters simulation;  ///< what the simulated robot is built from
};

/// Reads a plant model (keys plant_model.*, as `identify` writes them) or the parameters of a simulated robot (keys
/// plant.*), and derives the other. @throws ParameterError naming file and key, also if the file has neither.
PlantFile readPlantFile(const std::string& path);

}  // namespace jackal_aic
