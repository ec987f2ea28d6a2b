#pragma once

/// @file
/// Publisher of the ros_control controller, in a separate thread, because publishing locks and allocates.

#include <diagnostic_updater/diagnostic_updater.h>
#include <jackal_aic/ControllerState.h>
#include <nav_msgs/Odometry.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <semaphore.h>
#include <tf2_ros/transform_broadcaster.h>

#include <array>
#include <atomic>
#include <optional>
#include <string>
#include <thread>

#include "jackal_aic/safety/drive_loop.hpp"
#include "latest.hpp"
#include "outputs/diagnostics.hpp"
#include "outputs/odometry_output.hpp"
#include "outputs/state_output.hpp"
#include "ros_control_parameters.hpp"

namespace jackal_aic {

/// Odometry and state of the drive loop at one time.
struct OdometryUpdate {
  ControllerState state;  ///< by fillState()
  DriveLoopStatus status;
  PlanarPose pose;
  PlanarMotion motion;
  Eigen::Matrix3d pose_covariance = Eigen::Matrix3d::Zero();  ///< of the pose
  bool transform = false;                                     ///< publish the pose on tf too
};

/// Driven command at one time.
struct CommandUpdate {
  ros::Time stamp;
  BodyVector velocity = BodyVector::Zero();  ///< of the wheels' commands (base_link)
};

/// Publishes in the controller's namespace odom (nav_msgs/Odometry), state (ControllerState) and, with publish_cmd,
/// cmd_vel_out (geometry_msgs/TwistStamped), and also /tf and /diagnostics. post() neither locks nor allocates.
class RosControlPublisher {
 public:
  /// @param robot, controller namespaces; @param initial update with lists of the later length.
  RosControlPublisher(const ros::NodeHandle& robot, const ros::NodeHandle& controller,
                      const RosControlParameters& parameters, const OdometryUpdate& initial);
  ~RosControlPublisher();
  RosControlPublisher(const RosControlPublisher&) = delete;
  RosControlPublisher& operator=(const RosControlPublisher&) = delete;

  void post(const OdometryUpdate& update);
  void post(const CommandUpdate& update);

 private:
  void run();
  void publish(const OdometryUpdate& update);
  void publish(const CommandUpdate& update);

  std::string base_frame_;
  nav_msgs::Odometry odometry_;                                              // with its constant fields
  std::optional<std::array<double, 6>> pose_covariance_, twist_covariance_;  // diagonals, if they are configured
  ros::Publisher odometry_publisher_;
  tf2_ros::TransformBroadcaster broadcaster_;
  ros::Publisher command_publisher_;  // with publish_cmd
  ros::Publisher state_publisher_;
  StatusReport report_;
  diagnostic_updater::Updater diagnostics_;

  Latest<OdometryUpdate> odometry_updates_;
  Latest<CommandUpdate> command_updates_;
  sem_t news_{};
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace jackal_aic
