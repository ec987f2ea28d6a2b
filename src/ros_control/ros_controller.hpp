#pragma once

/// @file
/// The drive loop as a controller of ros_control, in place of diff_drive_controller.

#include <controller_interface/controller.h>
#include <hardware_interface/imu_sensor_interface.h>
#include <hardware_interface/joint_command_interface.h>
#include <jackal_aic/RosControllerConfig.h>
#include <ros/wall_timer.h>
#include <sensor_msgs/Imu.h>
#include <tf2/buffer_core.h>
#include <tf2_ros/transform_listener.h>

#include <array>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "inputs/other_publishers.hpp"
#include "inputs/robot_status.hpp"
#include "inputs/sensors.hpp"
#include "inputs/set_points.hpp"
#include "jackal_aic/odometry/odometry.hpp"
#include "jackal_aic/safety/drive_loop.hpp"
#include "latest.hpp"
#include "parameters/live_parameters.hpp"
#include "ros_control_parameters.hpp"
#include "ros_control_publisher.hpp"

namespace jackal_aic {

/// Plugin jackal_aic/ActiveInferenceController. Topics, parameters and services are those of diff_drive_controller, and
/// in addition the services and changes of the node (live_parameters.hpp) in its own namespace. In the namespace of the
/// robot it subscribes to imu/data (sensor_msgs/Imu), and to e_stop (std_msgs/Bool), status and feedback (jackal_msgs)
/// if they exist. An IMU with an ImuSensorHandle in the base frame is read there.
///
/// update() runs the due steps of the drive loop at any rate of calls. It neither locks nor allocates, except when it
/// adopts gains of the thesis' structure. Callbacks hand over their data by Latest.
class RosController : public controller_interface::Controller<hardware_interface::VelocityJointInterface> {
 public:
  /// False, with the reason in the log, for invalid parameters. @throws HardwareInterfaceException if the
  /// robot does not have a joint.
  bool init(hardware_interface::VelocityJointInterface* hw, ros::NodeHandle& root_nh,
            ros::NodeHandle& controller_nh) override;

  /// Starts from the speed of the wheels, so that a hand-over causes no jerk.
  void starting(const ros::Time& time) override;

  void update(const ros::Time& time, const ros::Duration& period) override;

  /// Commands zero, because no update follows.
  void stopping(const ros::Time& time) override;

 protected:
  /// As the base, with the robot's IMU if it has one.
  bool initRequest(hardware_interface::RobotHW* robot_hw, ros::NodeHandle& root_nh, ros::NodeHandle& controller_nh,
                   ClaimedResources& claimed_resources) override;

 private:
  using Joints = std::vector<hardware_interface::JointHandle>;

  /// Readings of the wheel encoders: mean speed [rad/s] and sum of positions [rad] of each side, for wheels of the
  /// drive loop's radius.
  struct Wheels {
    double left = 0.0, right = 0.0;
    double left_position = 0.0, right_position = 0.0;
    bool finite() const;
    bool operator!=(const Wheels& other) const;
  };

  void subscribe(ros::NodeHandle& robot, ros::NodeHandle& controller);
  void serveChanges(ros::NodeHandle& controller);
  void onCommand(const SetPointInput& command);
  void onImu(const sensor_msgs::Imu& message);
  void adoptLive(const LiveParameters& wanted);

  Wheels wheels() const;
  void followClockBack(double now);
  void takeSettings(double now);
  void takeLive(const LiveParameters& wanted, double now);
  void takeMessages(double now);
  std::optional<Observation> takeMeasurement(double now, double period);
  SensorReading imuOfRobot(double now) const;
  double sensorPeriod() const;
  bool wheelsAreDue(double now, double period, bool live, bool imu_came) const;
  Observation observe(const Wheels& wheels, double now);
  void drive(const WheelCommand& command);
  void advanceOdometry(const WheelCommand& applied, double duration);
  void publish(const ros::Time& time);

  std::string name_;
  RosControlParameters parameters_;
  std::optional<DriveLoop> loop_;
  Joints left_joints_, right_joints_;
  std::optional<hardware_interface::ImuSensorHandle> imu_handle_;

  // For the realtime thread only.
  LiveParameters live_;
  bool first_update_ = true;
  RobotStatus status_;
  double now_ = 0.0;           // of the last update [s]
  Wheels read_;                // in the last update
  bool changed_ = false;       // read_ differs from that of the update before
  Wheels last_wheels_;         // the last sample
  double wheels_taken_ = 0.0;  // time of the last sample [s]
  std::optional<Observation> imu_;
  std::optional<Odometry> odometry_;
  PlanarMotion commanded_motion_;
  DeadReckoning commanded_;        // in place of the odometry in open loop
  double last_publication_ = 0.0;  // s
  OdometryUpdate update_;          // with lists of final length, so that update() does not allocate

  // From callbacks of any thread to the realtime thread.
  std::mutex callbacks_;
  Latest<SetPointInput> commands_;
  Latest<SensorReading> imu_readings_;
  Latest<double> feedback_stamps_;
  Latest<RobotStatus> robot_states_;
  Latest<LiveParameters> settings_;
  std::optional<LoopExchange> changes_;

  tf2::BufferCore frames_;
  std::optional<tf2_ros::TransformListener> frame_listener_;
  std::optional<ImuReader> imu_reader_;
  std::optional<RobotReports> robot_;
  std::optional<RosControlPublisher> publisher_;
  std::optional<SetPointSource> command_source_;
  std::optional<OtherPublishers> others_;
  ros::Subscriber imu_subscriber_;
  std::optional<GainServer<LiveParameters, RosControllerConfig>> live_server_;
  std::optional<LiveParameterServer> live_parameters_;
  std::array<ros::ServiceServer, 2> drive_services_;  // enable and reset
};

}  // namespace jackal_aic
