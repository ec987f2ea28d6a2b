#include "jackal_aic/model/plant_model.hpp"

#include <algorithm>

namespace jackal_aic {
namespace {

constexpr double kLeastGain = 0.1;  // of its range

}  // namespace

PlantModel readPlantModel(ParameterMap& map, const PlantModel& defaults) {
  const PlantModel model = readParameters(map, "plant_model", defaults);
  if (model.effective_track > 0.0) requireInRange(geometryOf(model, {}), "plant_model");
  return model;
}

std::vector<PlantModel> confidenceBox(const PlantModel& model) {
  std::vector<PlantModel> corners{model};
  const auto span = [&corners](double PlantModel::*value, double half_width, double least) {
    if (half_width <= 0.0) return;
    std::vector<PlantModel> both;
    for (const double end : {-half_width, half_width}) {
      for (PlantModel corner : corners) {
        corner.*value = std::max(least, corner.*value + end);
        both.push_back(corner);
      }
    }
    corners = both;
  };
  span(&PlantModel::dead_time, model.dead_time_half_width, 0.0);
  span(&PlantModel::lag, model.lag_half_width, 0.0);
  span(&PlantModel::gain, model.gain_half_width, kLeastGain);
  span(&PlantModel::offset, model.offset_half_width, 0.0);
  return corners;
}

}  // namespace jackal_aic
