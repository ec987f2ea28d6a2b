#pragma once

/// @file
/// The YAML files that the command line tools read.

#include <optional>
#include <string>

#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/model/plant_model.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"
#include "jackal_aic/safety/gate_parameters.hpp"
#include "plant_parameters.hpp"

namespace jackal_aic {

/// A controller as its file describes it.
struct ControllerFile {
  ControllerParameters controller;
  GeometryParameters geometry;
  LimitParameters limits;
};

/// Reads a preset, or the whole configuration of a controller node; what is not about gains, geometry or limits is
/// checked for unknown keys only. @throws ParameterError naming file and key.
ControllerFile readControllerFile(const std::string& path);

/// A predictive controller as its file describes it.
struct PredictiveFile {
  PredictiveParameters parameters;
  std::optional<PlantModel> model;  ///< drive train that it believes in, if the file says
};

/// True if the file has keys predictive.*. @throws ParameterError if it can't be read.
bool describesPredictive(const std::string& path);

/// Reads the keys predictive.* and plant_model.* of a preset or a whole configuration. @throws ParameterError naming
/// file and key.
PredictiveFile readPredictiveFile(const std::string& path);

/// A robot as its file describes it.
struct PlantFile {
  PlantModel model;                 ///< what a certificate sees
  sim::PlantParameters simulation;  ///< what the simulated robot is built from
};

/// Reads a plant model (keys plant_model.*, as `identify` writes them) or the parameters of a simulated robot (keys
/// plant.*), and derives the other. @throws ParameterError naming file and key, also if the file has neither.
PlantFile readPlantFile(const std::string& path);

}  // namespace jackal_aic
