#include "controller_structure.hpp"

#include "predictive_structure.hpp"
#include "thesis_structure.hpp"

namespace jackal_aic {

std::unique_ptr<ControllerStructure> makeStructure(ros::NodeHandle& node, const NodeParameters& parameters,
                                                   VelocityController& controller) {
  std::optional<PlantModel> model = parameters.plant_model;
  if (model) model = drivenModel(*model);
  if (const auto* gains = std::get_if<PredictiveParameters>(&parameters.controller)) {
    return std::make_unique<PredictiveStructure>(node, *gains, *model, parameters.slip_file,
                                                 dynamic_cast<PredictiveController&>(controller));
  }
  return std::make_unique<ThesisStructure>(std::get<ControllerParameters>(parameters.controller), parameters.geometry,
                                           model, dynamic_cast<ActiveInferenceController&>(controller));
}

}  // namespace jackal_aic
