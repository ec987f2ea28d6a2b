#pragma once

/// @file
/// The thesis' controller in the node.

#include "controller_structure.hpp"
#include "jackal_aic/aic/active_inference_controller.hpp"

namespace jackal_aic {

/// Has no topics of its own.
class ThesisStructure : public ControllerStructure {
 public:
  /// @param loop that drives by this controller; it has to outlive the structure.
  ThesisStructure(const GeometryParameters& geometry, const DriveLoop& loop);

  ControllerState state() const override;
  SensorGeneralized measurement() const override;
  void publish(const std_msgs::Header&) override {}

 private:
  GeometryParameters geometry_;
  const ActiveInferenceController& controller_;  // of the loop
};

}  // namespace jackal_aic
