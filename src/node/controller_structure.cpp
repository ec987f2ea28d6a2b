#include "controller_structure.hpp"

#include "predictive_structure.hpp"
#include "thesis_structure.hpp"

namespace jackal_aic {

std::unique_ptr<ControllerStructure> makeStructure(ros::NodeHandle& node, const NodeParameters& parameters) {
  if (const auto* gains = std::get_if<PredictiveParameters>(&parameters.controller)) {
    return std::make_unique<PredictiveStructure>(node, *gains, parameters.geometry, *parameters.plant_model,
                                                 parameters.slip_file);
  }
  return std::make_unique<ThesisStructure>(std::get<ControllerParameters>(parameters.controller), parameters.geometry,
                                           parameters.plant_model);
}

}  // namespace jackal_aic
