#pragma once

/// @file
/// Every input of a DriveLoop as a value. A drive recorded as these values can be replayed exactly.

#include <optional>
#include <variant>

#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/model/types.hpp"
#include "jackal_aic/predictive/learned_model.hpp"
#include "jackal_aic/predictive/predictive_parameters.hpp"
#include "jackal_aic/safety/input_source.hpp"
#include "jackal_aic/safety/motor_share.hpp"

namespace jackal_aic {

/// One message of a sensor.
struct SensorReading {
  Observation observation;     ///< with the channels of this sensor only
  InputSource::Sample sample;  ///< raw values, to detect exact repetition
  bool may_repeat = false;     ///< exact repetition is normal while the robot moves
};

/// What the robot and its surroundings report in addition to the measurements.
struct RobotStatus {
  bool emergency_stop = false;       ///< a person's
  bool robot_stopped = false;        ///< the robot's own stop is engaged
  bool motors_off = false;           ///< the motors do not take velocity commands
  bool driver_fault = false;         ///< a motor driver reports a fault
  bool contended = false;            ///< an unexpected node publishes commands
  bool graph_checked = true;         ///< publishers of commands are known, those of the emergency stop connected
  bool ending = false;               ///< the controller ends
  bool rivals = false;               ///< more than one node publishes set points, unexpectedly
  bool disabled = false;             ///< a person holds the controller at rest
  bool no_subscriber = false;        ///< a topic of the commands has no subscriber: they do not reach the motors
  bool set_points_connected = true;  ///< publishers of set points are connected, so no set point is a pause
};

/// DriveLoop::updateBelief().
struct BeliefInput {};

/// DriveLoop::advance().
struct ActionInput {
  std::optional<double> due;  ///< time for which the timer was set [s]; empty: the loop keeps the time by itself
};

/// DriveLoop::setSetPoint().
struct SetPointInput {
  SetPoint wanted;              ///< base_link
  std::optional<double> stamp;  ///< time for which it was sent [s]; empty: unknown
};

/// DriveLoop::receiveWheels().
struct WheelsInput {
  SensorReading reading;  ///< as it came
};

/// DriveLoop::receiveImu().
struct ImuInput {
  SensorReading reading;  ///< as it came
};

/// DriveLoop::observe().
struct ObservationInput {
  Observation observation;  ///< of both, paired
};

/// DriveLoop::receiveFeedback().
struct FeedbackInput {
  double stamp = 0.0;  ///< [s]
};

/// DriveLoop::report().
struct StatusInput {
  RobotStatus status;  ///< from now on
};

/// DriveLoop::applied().
struct AppliedInput {
  WheelCommand command;                         ///< [rad/s]
  AppliedSource source = AppliedSource::drive;  ///< source of the command
};

/// DriveLoop::setLearned().
struct LearnedInput {
  LearnedModel learned;  ///< restored state
};

/// DriveLoop::freezeLearning().
struct LearningInput {
  bool frozen = false;  ///< stopped (true) or resumed
};

/// DriveLoop::adoptGains().
struct GainsInput {
  std::variant<ControllerParameters, PredictiveParameters> gains;  ///< of the structure that runs
};

/// DriveLoop::start().
struct StartInput {
  WheelCommand driven;  ///< [rad/s]
};

/// One call of a DriveLoop.
struct DriveInput {
  double now = 0.0;  ///< time of the call [s]
  std::variant<BeliefInput, ActionInput, SetPointInput, WheelsInput, ImuInput, ObservationInput, FeedbackInput,
               StatusInput, AppliedInput, LearnedInput, LearningInput, GainsInput, StartInput>
      what;  ///< the call, with its arguments
};

}  // namespace jackal_aic
