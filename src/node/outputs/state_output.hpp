#pragma once

/// @file
/// The controller as messages: topics jackal_AIC/state, sensor_generalized and, of the predictive structure,
/// jackal_AIC/belief. Every field of ControllerState is filled in here, for the node, for ros_control and for replay.

#include <geometry_msgs/TwistWithCovarianceStamped.h>
#include <jackal_aic/ControllerState.h>
#include <jackal_aic/SensorGeneralized.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "jackal_aic/safety/drive_loop.hpp"
#include "parameters/node_parameters.hpp"

namespace jackal_aic {

/// Fills in the state of the loop. Does not lock; allocates only if the message had other orders before.
void fillState(const DriveLoop& loop, const ros::Time& stamp, ControllerState& message);

/// What the loop does not know.
struct Surroundings {
  std::string contender;       ///< other publishers of commands or set points, with a remedy
  std::string no_subscriber;   ///< says that the commands have no subscriber; empty: they have one
  bool contended = false;      ///< another node publishes commands
  std::uint32_t rejected = 0;  ///< messages of sensors that the loop has not seen
};

/// Completes a message that fillState() filled in. @param frame of the body velocity.
void addRemarks(const DriveLoopStatus& status, const Surroundings& around, const std::string& frame,
                ControllerState& message);

/// Publishes state, measurement and belief of a drive loop.
class StateOutput {
 public:
  /// Opens the topics in the namespace of `node`. @param parameters of the node; @param loop has to outlive the output.
  StateOutput(ros::NodeHandle& node, const NodeParameters& parameters, const DriveLoop& loop);

  /// The last measurement of the controller. @param stamp of its message.
  void publishMeasurement(const ros::Time& stamp);

  /// The state after an action update, and the belief.
  void publish(const ros::Time& stamp, const DriveLoopStatus& status, const Surroundings& around);

 private:
  std::string frame_;
  const DriveLoop& loop_;
  ros::Publisher measurement_publisher_;
  ros::Publisher state_publisher_;
  ros::Publisher belief_publisher_;  // of the predictive structure
};

}  // namespace jackal_aic
