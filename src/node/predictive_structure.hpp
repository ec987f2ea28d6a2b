#pragma once

/// @file
/// The predictive controller in the node.

#include <ros/publisher.h>

#include "controller_structure.hpp"
#include "gain_server.hpp"
#include "jackal_aic/predictive_controller.hpp"

namespace jackal_aic {

/// Publishes the belief, an estimate of odometry grade, on jackal_AIC/belief
/// (geometry_msgs/TwistWithCovarianceStamped).
class PredictiveStructure : public ControllerStructure {
 public:
  /// Opens the topic in the namespace of `node`. @throws ParameterError if the rates are invalid.
  PredictiveStructure(ros::NodeHandle& node, const PredictiveParameters& gains, const GeometryParameters& geometry,
                      const PlantModel& model);

  VelocityController& controller() override { return controller_; }
  ControllerState state() const override;
  SensorGeneralized measurement() const override;
  void publish(const std_msgs::Header& header) override;

 private:
  void adopt(const PredictiveParameters& wanted);

  PredictiveController controller_;
  ros::Publisher belief_publisher_;
  GainServer<PredictiveParameters, PredictiveGainsConfig> gain_server_;
};

}  // namespace jackal_aic
