#pragma once

/// @file
/// The ROS node around the drive loop: it converts, calls and publishes; what happens is decided in drive_loop.hpp.
///
/// Subscribes: joint_states (sensor_msgs/JointState), imu/data (sensor_msgs/Imu), jackal_AIC/set_point
/// (geometry_msgs/Twist or TwistStamped), and if they are there e_stop (std_msgs/Bool), status and feedback
/// (jackal_msgs). Publishes: cmd_drive (jackal_msgs/Drive), cmd_vel (geometry_msgs/Twist) or the two wheel topics of
/// Gazebo, odom (nav_msgs/Odometry), with publish_inputs jackal_AIC/inputs (LoopInputs), sensor_generalized
/// (SensorGeneralized), jackal_AIC/state (ControllerState), with the predictive structure jackal_AIC/belief
/// (geometry_msgs/TwistWithCovarianceStamped), /diagnostics. Services ~enable and ~reset (drive_services.hpp); gains
/// and what is learned can be changed as loop_tuning.hpp says.

#include <diagnostic_updater/diagnostic_updater.h>
#include <geometry_msgs/Twist.h>
#include <ros/ros.h>
#include <tf2_ros/transform_listener.h>

#include <cstdint>
#include <memory>
#include <optional>

#include "applied_commands.hpp"
#include "command_output.hpp"
#include "controller_structure.hpp"
#include "drive_services.hpp"
#include "graph_watch.hpp"
#include "input_log.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "loop_tuning.hpp"
#include "node_parameters.hpp"
#include "odometry_output.hpp"
#include "robot_watch.hpp"
#include "sensor_pairing.hpp"
#include "set_point_source.hpp"
#include "status_report.hpp"

namespace jackal_aic {

/// Runs the drive loop on ROS time: a belief timer and an action timer at their rates. All callbacks run in one thread.
class ControllerNode : private LoopChanges {
 public:
  /// Opens the topics in the namespace of `node`, the services in that of `private_node`, and starts the timers.
  /// @throws ParameterError if the set point comes from a topic on which our own commands come back, or as
  /// makeTuning().
  ControllerNode(const ros::NodeHandle& node, const ros::NodeHandle& private_node, const NodeParameters& parameters);

  /// Brakes from now on, for the end of the node. The timers have to be served until atRest().
  void brake() { ending_ = true; }

  /// True if the last command was zero.
  bool atRest() const { return loop_.command() == WheelCommand{}; }

  /// Publishes a zero command, for the end of the node; nothing while another node has the motors.
  void publishStop();

 private:
  void onSetPoint(const ReceivedSetPoint& received);
  void onWheels(const sensor_msgs::JointStateConstPtr& message);
  void onImu(const sensor_msgs::ImuConstPtr& message);
  void onPair(const Observation& observation, const ros::Time& stamp);
  void onBeliefTimer(const ros::TimerEvent& event);
  void onActionTimer(const ros::TimerEvent& event);

  /// Refuses a set point from a topic that carries our own commands. Throws ParameterError.
  void requireForeignSetPoints() const;
  double currentTime();

  static double rosTime() { return ros::Time::now().toSec(); }
  void adoptGains(const ControllerParameters& gains) override { loop_.adoptGains(gains, rosTime()); }
  void adoptGains(const PredictiveParameters& gains) override { loop_.adoptGains(gains, rosTime()); }
  void setSlip(const SlipState& slip) override { loop_.setSlip(slip, rosTime()); }
  void freezeLearning(bool frozen) override { loop_.freezeLearning(frozen, rosTime()); }
  SlipState slip() const override;
  DriveServices::Actions serviceActions();

  RobotStatus robotStatus() const;
  bool contended() const;
  bool rivalled() const;
  std::uint8_t drivenBy() const;
  void watchClock();
  void refuseReading();
  void publishMeasurement(const ros::Time& stamp);
  void publishState(const ros::Time& now);
  void reportStatus();
  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status);

  ros::NodeHandle node_;
  NodeParameters parameters_;
  SkidSteerKinematics kinematics_;
  DriveLoop loop_;
  std::unique_ptr<InputLog> inputs_;  // with publish_inputs; there before anything is told to the loop
  std::unique_ptr<ControllerStructure> structure_;
  std::unique_ptr<LoopTuning> tuning_;
  DriveServices services_;
  CommandOutput output_;
  OdometryOutput odometry_;
  tf2_ros::Buffer transforms_;
  tf2_ros::TransformListener transform_listener_;
  SensorPairing sensors_;
  RobotWatch robot_;
  std::optional<AppliedCommands> applied_;  // where somebody else may drive
  GraphWatch graph_;
  StatusReport report_;
  ros::Time last_now_;             // of the last callback, to notice a clock that jumps back
  ros::Time watched_time_;         // of the clock, at the last look
  ros::WallTime watched_advance_;  // when the clock was seen to go on
  bool clock_stands_ = false;      // and this was told
  std::uint32_t rejected_readings_ = 0;
  std::optional<WheelCommand> measured_wheels_;  // the last wheel speeds [rad/s]
  std::optional<double> measured_yaw_rate_;      // the last of the gyro [rad/s]
  bool ending_ = false;
  bool enabled_ = true;

  diagnostic_updater::Updater diagnostics_;
  ros::Publisher sensor_publisher_;
  ros::Publisher state_publisher_;
  SetPointSource set_points_;
  ros::Subscriber wheel_subscriber_;
  ros::Subscriber imu_subscriber_;
  ros::Timer belief_timer_;
  ros::Timer action_timer_;
  ros::WallTimer clock_timer_;
};

}  // namespace jackal_aic
