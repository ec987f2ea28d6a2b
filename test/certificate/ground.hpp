#pragma once

#include "jackal_aic/model/plant_model.hpp"

namespace jackal_aic {

/// The drive train of config/plant_model.yaml.
inline PlantModel ground() {
  PlantModel model;
  model.dead_time = 0.08;
  model.lag = 0.00636;
  model.velocity_loop_integral = 0.678;
  return model;
}

}  // namespace jackal_aic
