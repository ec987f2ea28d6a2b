#pragma once

/// @file
/// What the node tells of its controller: topics jackal_AIC/state, sensor_generalized, and those of the structure.

#include <ros/node_handle.h>
#include <ros/publisher.h>

#include <memory>
#include <string>

#include "controller_structure.hpp"
#include "node_parameters.hpp"
#include "state_message.hpp"

namespace jackal_aic {

/// Publishes state and measurements of a drive loop.
class StateOutput {
 public:
  /// Opens the topics in the namespace of `node`. @param loop has to outlive the output.
  StateOutput(ros::NodeHandle& node, const NodeParameters& parameters, const DriveLoop& loop);

  /// The measurement that the controller took last. @param stamp of its message.
  void publishMeasurement(const ros::Time& stamp);

  /// @param reason as fillState() takes it; @param by_another another source has the motors; @param unheard says that
  /// the commands have no subscriber and so drive nothing: empty if they have one; @param rejected messages of
  /// sensors that the loop has not seen.
  void publish(const LoopState& state, const std::string& reason, bool by_another, const std::string& unheard,
               std::uint32_t rejected);

 private:
  std::string frame_;
  std::unique_ptr<ControllerStructure> structure_;
  ros::Publisher measurement_publisher_;
  ros::Publisher state_publisher_;
};

}  // namespace jackal_aic
