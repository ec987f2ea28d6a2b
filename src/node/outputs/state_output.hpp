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
#include <limits>
#include <string>

#include "jackal_aic/safety/drive_loop.hpp"
#include "parameters/node_parameters.hpp"

namespace jackal_aic {

/// A drive loop at one time. Of fixed size: it may be handed from one thread to another.
struct LoopState {
  ros::Time stamp;         ///< of the action update
  DriveLoopStatus status;  ///< of the loop
  SetPoint set_point;      ///< in force
  BodyVector measured =
      BodyVector::Constant(std::numeric_limits<double>::quiet_NaN());  ///< by the wheels, and the gyro; NaN: not yet
  WheelCommand action;                                                 ///< before the limits [rad/s]
  WheelCommand command;                                                ///< [rad/s]
  bool predictive = false;                                             ///< structure that runs
  GeneralizedBody belief;                                              ///< mu_tilde; no columns: the baseline has none
  GeneralizedBody state_errors;                                        ///< eps_mu; no columns: none
  GeneralizedSensor sensory_errors;                                    ///< eps_y
  double free_energy = 0.0;                                            ///< F
  double effective_track = 0.0;                                        ///< believed, or as configured [m]
  double slip_factor = 0.0;                                            ///< as configured
  DriveTrainTiming timing{};                                           ///< believed [s]
  Eigen::Vector4d turn = Eigen::Vector4d::Zero();                      ///< learned coefficients q
  bool learning_frozen = false;                                        ///< nothing is learned for now
  WheelCommand wheels;                                                 ///< believed speeds [rad/s]
  WheelCommand disturbances;                                           ///< believed [rad/s]
};

/// The loop as it is now; neither locks nor allocates. @param geometry as configured; @param measured as in LoopState.
LoopState loopState(const DriveLoop& loop, const GeometryParameters& geometry, const BodyVector& measured,
                    const ros::Time& stamp);

/// What the surroundings of the loop add to its state.
struct StateRemarks {
  std::string reason;          ///< for which the robot is not driven, see StopReason
  std::string unheard;         ///< says that the commands have no subscriber; empty: they have one
  bool by_another = false;     ///< another node has the motors
  std::uint32_t rejected = 0;  ///< messages of sensors that the loop has not seen
};

/// The state as a message. @param frame of the body velocity.
ControllerState stateMessage(const LoopState& state, const StateRemarks& remarks, const std::string& frame);

/// y_tilde as a message; the header is left to the caller.
SensorGeneralized sensorMessage(const GeneralizedSensor& measurement);

/// Believed body velocity with its covariance; header left to the caller. What the belief says nothing about has the
/// variance kUnknownVariance.
geometry_msgs::TwistWithCovarianceStamped beliefMessage(const PredictiveController& controller);

/// Publishes state, measurement and belief of a drive loop.
class StateOutput {
 public:
  /// Opens the topics in the namespace of `node`. @param parameters of the node; @param loop has to outlive the output.
  StateOutput(ros::NodeHandle& node, const NodeParameters& parameters, const DriveLoop& loop);

  /// The measurement that the controller took last. @param stamp of its message.
  void publishMeasurement(const ros::Time& stamp);

  /// The state after an action update, and the belief.
  void publish(const LoopState& state, const StateRemarks& remarks);

 private:
  std::string frame_;
  const DriveLoop& loop_;
  ros::Publisher measurement_publisher_;
  ros::Publisher state_publisher_;
  ros::Publisher belief_publisher_;  // of the predictive structure
};

}  // namespace jackal_aic
