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

/// Part of the state that the loop does not know.
struct StateRemarks {
  std::string reason;                ///< why the robot is not driven, reason(DriveLoopStatus)
  std::string no_subscriber;         ///< says that the commands have no subscriber; empty: they have one
  bool by_another = false;           ///< another node has the motors
  std::uint32_t rejected = 0;        ///< messages of sensors that the loop has not seen
  faults::Suspicion suspicion = {};  ///< DriveLoopStatus::suspicion
};

/// Completes a message that fillState() filled in. @param frame of the body velocity.
void addRemarks(const StateRemarks& remarks, const std::string& frame, ControllerState& message);

/// The status in a word: "driving".
const char* statusName(const ControllerState& state);

/// y_tilde as a message; the header is left to the caller.
SensorGeneralized sensorMessage(const GeneralizedSensor& measurement);

/// Believed body velocity with its covariance; header left to the caller. Components outside the belief have
/// kUnknownVariance.
geometry_msgs::TwistWithCovarianceStamped beliefMessage(const PredictiveController& controller);

/// Publishes state, measurement and belief of a drive loop.
class StateOutput {
 public:
  /// Opens the topics in the namespace of `node`. @param parameters of the node; @param loop has to outlive the output.
  StateOutput(ros::NodeHandle& node, const NodeParameters& parameters, const DriveLoop& loop);

  /// The last measurement of the controller. @param stamp of its message.
  void publishMeasurement(const ros::Time& stamp);

  /// The state after an action update, and the belief.
  void publish(const ros::Time& stamp, const StateRemarks& remarks);

 private:
  std::string frame_;
  const DriveLoop& loop_;
  ros::Publisher measurement_publisher_;
  ros::Publisher state_publisher_;
  ros::Publisher belief_publisher_;  // of the predictive structure
};

}  // namespace jackal_aic
