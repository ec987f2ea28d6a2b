#pragma once

/// @file
/// The predictive controller in the node.

#include <ros/publisher.h>

#include "controller_structure.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"

namespace jackal_aic {

/// Publishes the belief, an estimate of odometry grade, on jackal_AIC/belief
/// (geometry_msgs/TwistWithCovarianceStamped).
class PredictiveStructure : public ControllerStructure {
 public:
  /// Opens the topic in the namespace of `node`. @param loop that drives by this controller; it has to outlive the
  /// structure.
  PredictiveStructure(ros::NodeHandle& node, const DriveLoop& loop);

  ControllerState state() const override;
  SensorGeneralized measurement() const override;
  void publish(const std_msgs::Header& header) override;

 private:
  const PredictiveController& controller_;  // of the loop
  ros::Publisher belief_publisher_;
};

}  // namespace jackal_aic
