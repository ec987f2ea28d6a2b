#pragma once

/// @file
/// The thesis' controller in the node.

#include "controller_structure.hpp"
#include "gain_server.hpp"
#include "jackal_aic/aic/active_inference_controller.hpp"

namespace jackal_aic {

/// Certifies the gains on the plant model, where there is one, when it starts and before it takes over changed ones.
class ThesisStructure : public ControllerStructure {
 public:
  /// @param loop whose controller has these gains; it has to outlive the structure.
  ThesisStructure(const ControllerParameters& gains, const GeometryParameters& geometry, DriveLoop& loop);

  ControllerState state() const override;
  SensorGeneralized measurement() const override;
  void publish(const std_msgs::Header&) override {}

 private:
  void reportCertificate(const ControllerParameters& gains) const;
  void adopt(const ControllerParameters& wanted, const ControllerParameters& running);

  GeometryParameters geometry_;
  DriveLoop& loop_;
  const ActiveInferenceController& controller_;  // of the loop
  GainServer<ControllerParameters, ControllerGainsConfig> gain_server_;
};

}  // namespace jackal_aic
