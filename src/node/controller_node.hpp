#pragma once

/// @file
/// The ROS node around the active inference controller: convert, update, convert.
///
/// Subscribes: joint_states (sensor_msgs/JointState), imu/data (sensor_msgs/Imu), jackal_AIC/set_point
/// (geometry_msgs/Twist), and if they are there e_stop (std_msgs/Bool), status and feedback (jackal_msgs). Publishes:
/// cmd_drive (jackal_msgs/Drive), cmd_vel (geometry_msgs/Twist) or the two wheel topics of Gazebo,
/// sensor_generalized (SensorGeneralized), jackal_AIC/state (ControllerState), with the predictive structure
/// jackal_AIC/belief (geometry_msgs/TwistWithCovarianceStamped), /diagnostics. Gains can be changed through
/// dynamic_reconfigure in ~controller or ~predictive.

#include <diagnostic_updater/diagnostic_updater.h>
#include <geometry_msgs/Twist.h>
#include <ros/ros.h>
#include <tf2_ros/transform_listener.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "command_output.hpp"
#include "controller_structure.hpp"
#include "graph_watch.hpp"
#include "jackal_aic/drive_gate.hpp"
#include "jackal_aic/step_schedule.hpp"
#include "measurement_watch.hpp"
#include "motor_watch.hpp"
#include "node_parameters.hpp"
#include "robot_watch.hpp"
#include "sensor_pairing.hpp"

namespace jackal_aic {

/// Runs the controller on ROS time: a belief timer and an action timer at their rates. All callbacks run in one thread.
class ControllerNode {
 public:
  /// Opens the topics in the namespace of `node` and starts the timers. @throws ParameterError if the set point comes
  /// from a topic on which our own commands come back.
  ControllerNode(const ros::NodeHandle& node, const NodeParameters& parameters);

  /// Brakes from now on, for the end of the node. The timers have to be served until atRest().
  void brake() { ending_ = true; }

  /// True if the last command was zero.
  bool atRest() const { return gate_.command() == WheelCommand{}; }

  /// Publishes a zero command, for the end of the node; nothing while another node has the motors.
  void publishStop();

 private:
  void onSetPoint(const geometry_msgs::Twist& message);
  void onWheels(const sensor_msgs::JointStateConstPtr& message);
  void onImu(const sensor_msgs::ImuConstPtr& message);
  void onObservation(Observation observation, const ros::Time& stamp);
  void onBeliefTimer(const ros::TimerEvent& event);
  void onActionTimer(const ros::TimerEvent& event);

  /// Refuses a set point from a topic that carries our own commands. Throws ParameterError.
  void requireForeignSetPoints() const;
  ros::Time currentTime();
  void reset();
  void catchUp(const ros::Time& now);
  void updateBelief();
  WheelCommand act(const ros::Time& now);
  WheelCommand drive(const ros::Time& now);
  /// Command that somebody else gives the motors, with output: twist; empty if they have ours.
  std::optional<WheelCommand> othersCommand(const ros::Time& now);
  /// The command that the motors have, as far as anybody knows.
  WheelCommand appliedCommand();
  GateInputs gateInputs(const ros::Time& now);
  InputAges ages(const ros::Time& now) const;
  bool contended() const;
  std::string reason() const;
  void startAnew();
  /// Belief from the last measurement alone, while the wheels show what the motors did in a stall: no model knows it.
  void seedBelief();
  void reportRefusal(const char* what, std::uint32_t count);
  void reportStatus(const GateDecision& decision);
  void publishState(const ros::Time& now, const WheelCommand& command);
  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status);

  ros::NodeHandle node_;
  NodeParameters parameters_;
  std::unique_ptr<ControllerStructure> structure_;
  VelocityController& controller_;  // of the structure
  SkidSteerKinematics kinematics_;
  DriveGate gate_;
  StepSchedule schedule_;
  CommandOutput output_;
  tf2_ros::Buffer transforms_;
  tf2_ros::TransformListener transform_listener_;
  SensorPairing sensors_;
  RobotWatch robot_;
  GraphWatch graph_;
  MotorWatch motors_;
  MeasurementWatch measurements_;

  GateDecision decision_;
  bool handed_over_ = false;  // somebody else has the motors
  ros::Time last_action_;     // time of the last command; zero before the first
  std::string reason_;        // of the decision, as it was told last
  SetPoint set_point_;
  ros::Time set_point_received_;    // zero before the first
  ros::Time measurement_stamp_;     // of the last observation the controller took; zero before the first
  ros::Time measurement_received_;  // when it was taken
  bool taken_alone_ = false;        // that observation was of one source, the other being silent
  bool clock_jumped_ = false;       // back, and the robot has not come to rest since
  bool ending_ = false;
  ros::Time last_now_;   // of the last callback, to notice a clock that jumps back
  WheelCommand action_;  // before limits, of the last action step
  std::uint32_t rejected_set_points_ = 0;
  std::uint32_t rejected_measurements_ = 0;
  std::uint32_t clock_resets_ = 0;
  std::uint32_t brakes_ = 0;
  std::uint32_t faults_ = 0;

  diagnostic_updater::Updater diagnostics_;
  ros::Publisher sensor_publisher_;
  ros::Publisher state_publisher_;
  ros::Subscriber set_point_subscriber_;
  ros::Subscriber wheel_subscriber_;
  ros::Subscriber imu_subscriber_;
  ros::Timer belief_timer_;
  ros::Timer action_timer_;
};

}  // namespace jackal_aic
