#pragma once

/// @file
/// The fastest response that a plant allows: what no controller can beat that learns of a set point when it changes.

#include "result_table.hpp"

namespace jackal_aic::sim {

/// Name of the limit in the place of a controller.
inline constexpr const char* kPlantLimit = "plant_limit";

/// The forward speed follows the set point of one dead time ago as fast as the acceleration limit lets it; the motors'
/// lag, the period of the action and friction do not count. A bound from below for the tracking error of every
/// controller that cannot foresee the set point.
RunResult runPlantLimit(const std::string& plant_name, const PlantParameters& plant, const SetPointProfile& profile);

}  // namespace jackal_aic::sim
