#pragma once

/// @file
/// Between ROS messages and the types of the core. Pure functions; what is unusable comes back as std::nullopt.

#include <geometry_msgs/Twist.h>
#include <geometry_msgs/TwistStamped.h>
#include <geometry_msgs/TwistWithCovarianceStamped.h>
#include <jackal_aic/ControllerState.h>
#include <jackal_aic/SensorGeneralized.h>
#include <jackal_msgs/Drive.h>
#include <jackal_msgs/Feedback.h>
#include <jackal_msgs/Status.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <topic_tools/shape_shifter.h>

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "jackal_aic/aic/active_inference_controller.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/predictive/predictive_controller.hpp"
#include "jackal_aic/safety/drive_input.hpp"

namespace jackal_aic {

/// Variance, in a covariance matrix of a message, of what is not known [(m/s)^2, (rad/s)^2].
inline constexpr double kUnknownVariance = 1e6;

/// True if at least one of the joints is named in the message (other nodes publish joint states too).
bool mentionsAny(const sensor_msgs::JointState& message, const std::vector<std::string>& joints);

/// Mean velocity [rad/s] of those of the joints that the message lists. std::nullopt if it lists none of them, or a
/// velocity is missing, or the mean is not finite.
std::optional<double> meanVelocity(const sensor_msgs::JointState& message, const std::vector<std::string>& joints);

/// Sum of the positions [rad] of those of the joints that the message lists with one. std::nullopt if it lists none, or
/// one that is not finite.
std::optional<double> sumOfPositions(const sensor_msgs::JointState& message, const std::vector<std::string>& joints);

/// Angular velocity and acceleration of an IMU message as (theta_dot, x_ddot, y_ddot, f_z) in the base frame, those of
/// an Observation: the message's attitude takes gravity out of x and y, f_z keeps it. A message without attitude (first
/// covariance -1, or no unit quaternion) leaves gravity in x and y too.
/// @param rotation from the IMU's frame into the base frame. std::nullopt if a component is not finite.
std::optional<Eigen::Vector4d> planarMotion(const sensor_msgs::Imu& message, const Eigen::Quaterniond& rotation);

/// Set point of a Twist (linear.x, angular.z). std::nullopt if any component is not finite. A skid-steer robot cannot
/// follow the other components: they are left out.
std::optional<SetPoint> setPoint(const geometry_msgs::Twist& message);

/// A set point as it was sent.
struct ReceivedSetPoint {
  SetPoint wanted;              ///< not finite if any component is not
  std::optional<double> stamp;  ///< [s]; empty if the message has none
  double sideways = 0.0;        ///< linear.y, which `wanted` leaves out [m/s]
};

/// Set point of a message of any type: geometry_msgs/Twist, or TwistStamped, whose stamp counts unless it is zero.
/// std::nullopt for another type.
std::optional<ReceivedSetPoint> receivedSetPoint(const topic_tools::ShapeShifter& message);

/// Wheel speeds of a drive message, zero in another mode than velocity. std::nullopt if one is not finite.
std::optional<WheelCommand> wheelCommand(const jackal_msgs::Drive& message);

/// What a message of the robot says about its stop.
void takeStatus(const jackal_msgs::Status& message, RobotStatus& status);

/// What a message of the motors says about them.
void takeFeedback(const jackal_msgs::Feedback& message, RobotStatus& status);

/// Drive message in velocity mode.
jackal_msgs::Drive driveMessage(const WheelCommand& command);

/// Body velocity as a Twist (linear.x, angular.z).
geometry_msgs::Twist twistMessage(const BodyVector& velocity);

/// y_tilde as a message; the header is left to the caller.
SensorGeneralized sensorMessage(const GeneralizedSensor& measurement);

/// Belief, prediction errors and free energy as a message; the rest, with the effective track, is left to the caller.
ControllerState stateMessage(const ActiveInferenceController& controller);

/// As above, with the beliefs about wheels and effective track.
ControllerState stateMessage(const PredictiveController& controller);

/// Believed body velocity with its covariance; header left to the caller. What the belief says nothing about has the
/// variance kUnknownVariance.
geometry_msgs::TwistWithCovarianceStamped beliefMessage(const PredictiveController& controller);

}  // namespace jackal_aic
