#include "controller_structure.hpp"

#include "predictive_structure.hpp"
#include "thesis_structure.hpp"

namespace jackal_aic {
namespace {

/// The baseline has no belief.
class OpenLoopStructure : public ControllerStructure {
 public:
  explicit OpenLoopStructure(const GeometryParameters& geometry) : geometry_(geometry) {}

  ControllerState state() const override {
    ControllerState message;
    message.effective_track = geometry_.effective_track;
    message.slip_factor = geometry_.slip_factor;
    return message;
  }

  SensorGeneralized measurement() const override { return {}; }
  void publish(const std_msgs::Header&) override {}

 private:
  GeometryParameters geometry_;
};

}  // namespace

std::unique_ptr<ControllerStructure> makeStructure(ros::NodeHandle& node, const NodeParameters& parameters,
                                                   const DriveLoop& loop) {
  if (std::holds_alternative<PredictiveParameters>(parameters.controller)) {
    return std::make_unique<PredictiveStructure>(node, loop);
  }
  if (std::holds_alternative<DifferentialDriveParameters>(parameters.controller)) {
    return std::make_unique<OpenLoopStructure>(parameters.geometry);
  }
  return std::make_unique<ThesisStructure>(parameters.geometry, loop);
}

}  // namespace jackal_aic
