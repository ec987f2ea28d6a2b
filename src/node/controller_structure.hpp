#pragma once

/// @file
/// What only one kind of controller tells on the ROS side: fields of the state, topics of its own.

#include <jackal_aic/ControllerState.h>
#include <jackal_aic/SensorGeneralized.h>
#include <ros/node_handle.h>
#include <std_msgs/Header.h>

#include <memory>

#include "jackal_aic/safety/drive_loop.hpp"
#include "node_parameters.hpp"

namespace jackal_aic {

/// What the node needs of a controller beyond VelocityController.
class ControllerStructure {
 public:
  virtual ~ControllerStructure() = default;

  /// Belief, prediction errors, free energy and what else the structure fills in; the rest is left to the caller.
  virtual ControllerState state() const = 0;

  /// Measurement that the controller took last; the header is left to the caller.
  virtual SensorGeneralized measurement() const = 0;

  /// Publishes what the structure has in addition to the state, after each action update.
  /// @param header stamp of the update, frame of the body velocity.
  virtual void publish(const std_msgs::Header& header) = 0;
};

/// What belongs to the controller of a loop, which makeController(parameters) built; opens its topics in the namespace
/// of `node`. @param loop has to outlive the structure.
std::unique_ptr<ControllerStructure> makeStructure(ros::NodeHandle& node, const NodeParameters& parameters,
                                                   const DriveLoop& loop);

}  // namespace jackal_aic
