#pragma once

/// @file
/// The ROS node around the drive loop: it converts, calls and publishes; what happens is decided in drive_loop.hpp.
/// Topics and services: doc/reference/topics.md.

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <ros/spinner.h>
#include <tf2/buffer_core.h>
#include <tf2_ros/transform_listener.h>

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "inputs/other_publishers.hpp"
#include "inputs/robot_status.hpp"
#include "inputs/sensors.hpp"
#include "inputs/set_points.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "outputs/commands.hpp"
#include "outputs/diagnostics.hpp"
#include "outputs/input_log.hpp"
#include "outputs/odometry_output.hpp"
#include "outputs/state_output.hpp"
#include "parameters/live_parameters.hpp"
#include "parameters/node_parameters.hpp"
#include "process/shutdown.hpp"

namespace jackal_aic {

/// Runs the drive loop on ROS time by an action timer; the beliefs catch up with each call. All callbacks run in one
/// thread, but for certified changes of gains and diagnostics, which take longer than a period.
class ControllerNode {
 public:
  /// Opens the topics in the namespace of `node`, the services in that of `private_node`, and starts the timers.
  /// @throws ParameterError if the set point comes from a topic on which our own commands come back.
  ControllerNode(const ros::NodeHandle& node, const ros::NodeHandle& private_node, const NodeParameters& parameters);

  /// Drives until the end is requested, then brakes and publishes zero; nothing while another node drives the motors.
  /// @returns false if the output does not suit the robot: the node has logged it.
  bool run(StopRequest& stop);

 private:
  void onWheels(const sensor_msgs::JointStateConstPtr& message);
  void onImu(const sensor_msgs::ImuConstPtr& message);
  void onFeedback(const ros::Time& stamp);
  void onPair(const Observation& observation, const ros::Time& stamp);
  void onActionTimer(const ros::TimerEvent& event);

  double currentTime();
  void setActionTimer(double due);

  RobotStatus robotStatus() const;
  void take(const std::optional<SensorReading>& reading, const ros::Time& stamp, const std::function<bool()>& receive);
  void resetSensors();
  std::string missing() const;
  std::string contender() const;

  ros::NodeHandle node_;
  NodeParameters parameters_;
  DriveLoop loop_;

  // Between the driving and the serving thread.
  LoopExchange changes_;
  DiagnosticsOutput diagnostics_;

  ros::CallbackQueue requests_;
  std::unique_ptr<InputLog> inputs_;  // with publish_inputs; made before the first input of the loop
  StateOutput state_;
  LiveParameterServer live_parameters_;
  std::array<ros::ServiceServer, 2> drive_services_;  // enable and reset
  CommandOutput output_;
  OdometryOutput odometry_;
  tf2::BufferCore frames_;
  tf2_ros::TransformListener frame_listener_;
  SensorPairing sensors_;
  RobotReports robot_;
  std::array<ros::Subscriber, 2> applied_;  // if another source may drive
  SetPointSource set_points_;
  OtherPublishers others_;
  ros::Time last_now_;         // of the last callback, to notice a clock that jumps back
  std::string no_subscriber_;  // CommandOutput::complaint() of the last action
  std::uint32_t rejected_readings_ = 0;
  bool ending_ = false;
  bool refused_ = false;

  ros::Subscriber wheel_subscriber_;
  ros::Subscriber imu_subscriber_;
  ros::Timer action_timer_;
  double action_due_ = 0.0;  // time for which it is set [s]
  ros::WallTimer clock_timer_;
  ros::WallTimer report_timer_;
  ros::AsyncSpinner request_thread_;  // the last, so that it ends first
};

}  // namespace jackal_aic
