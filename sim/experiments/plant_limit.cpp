#include "plant_limit.hpp"

#include <algorithm>
#include <cmath>

namespace jackal_aic::sim {

RunResult runPlantLimit(const std::string& plant_name, const PlantParameters& plant, const SetPointProfile& profile) {
  const double largest_change = plant.acceleration_limit * JackalPlant::kStep;
  const std::int64_t steps = profile.plantSteps();
  RunResult result;
  double velocity = 0.0;
  for (std::int64_t k = 0; k < steps; ++k) {
    Sample sample{};
    sample.time = static_cast<double>(k) * JackalPlant::kStep;
    sample.set_point = profile.at(sample.time);
    const double wanted = profile.at(sample.time - plant.dead_time).forward;
    velocity += std::clamp(wanted - velocity, -largest_change, largest_change);
    sample.velocity = sample.measured_velocity = velocity;
    result.samples.push_back(sample);
  }
  result.row.controller = kPlantLimit;
  result.row.plant = plant_name;
  describeStep(profile, result.row);
  describeResponse(assess(result.samples, profile), result.row);
  return result;
}

}  // namespace jackal_aic::sim
