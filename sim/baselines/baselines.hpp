#pragma once

/// @file
/// The baselines of control by name, with what is tuned of each.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "jackal_aic/aic/velocity_controller.hpp"
#include "jackal_aic/model/plant_model.hpp"

namespace jackal_aic::sim {

/// A number that is tuned: positive, searched in its logarithm.
struct Tunable {
  const char* name;
  double start, low, high;
};

/// A structure of controllers.
struct Baseline {
  std::string name;            ///< in a table
  std::string title;           ///< in words, with its source
  std::vector<Tunable> tuned;  ///< the start is a textbook's choice where there is one
  /// The controller with these values of what is tuned, on a robot of this model.
  std::function<std::unique_ptr<VelocityController>(const std::vector<double>& values, const PlantModel& model,
                                                    const GeometryParameters& geometry)>
      make;

  /// Where the search starts.
  std::vector<double> start() const;
};

/// SIMC PI and PID, PI with Smith predictor, LQG, linear ADRC, MPC and delayed feedback active inference.
const std::vector<Baseline>& controlBaselines();

}  // namespace jackal_aic::sim
