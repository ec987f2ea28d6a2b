#pragma once

/// @file
/// The YAML file of a robot on which gains are searched.

#include <string>

#include "jackal_aic/model/plant_model.hpp"
#include "plant_parameters.hpp"

namespace jackal_aic {

/// A robot as its file describes it.
struct PlantFile {
  PlantModel model;                 ///< what a certificate sees
  sim::PlantParameters simulation;  ///< what the simulated robot is built from
};

/// Reads a plant model (keys plant_model.*, as `identify` writes them) or the parameters of a simulated robot (keys
/// plant.*), and derives the other. @throws ParameterError naming file and key, also if the file has neither.
PlantFile readPlantFile(const std::string& path);

}  // namespace jackal_aic
