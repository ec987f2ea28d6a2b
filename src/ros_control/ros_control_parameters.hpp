#pragma once

/// @file
/// Parameters of the controller of ros_control: those of diff_drive_controller, by their names and meanings, and those
/// of the drive loop.

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "parameters/node_parameters.hpp"

namespace jackal_aic {

/// Parameters that can change at run time.
struct LiveParameters {
  double left_wheel_radius_multiplier = 1.0;
  double right_wheel_radius_multiplier = 1.0;
  double wheel_separation_multiplier = 1.0;
  double publish_rate = 50.0;  ///< of odometry and tf [Hz]; 0: never
  bool enable_odom_tf = true;  ///< publish the transform from odom_frame_id to base_frame_id
};

/// Lists the fields of LiveParameters with unit and range.
template <class Visitor>
void describeFields(Visitor& v, LiveParameters& p) {
  constexpr Bounds kMultiplier{0.1, 10.0};
  v.field("left_wheel_radius_multiplier", p.left_wheel_radius_multiplier, kMultiplier, "", Presence::optional);
  v.field("right_wheel_radius_multiplier", p.right_wheel_radius_multiplier, kMultiplier, "", Presence::optional);
  v.field("wheel_separation_multiplier", p.wheel_separation_multiplier, kMultiplier, "", Presence::optional);
  v.field("publish_rate", p.publish_rate, {0.0, 1e4}, "Hz", Presence::optional);
  v.field("enable_odom_tf", p.enable_odom_tf, Presence::optional);
}

/// Configuration of the controller.
struct RosControlParameters {
  NodeParameters drive;  ///< of the drive loop; its deadline of the set point is cmd_vel_timeout, its track the
                         ///< separation of the wheels times its multiplier
  LiveParameters live;   ///< at the start
  double wheel_separation = 0.0;  ///< between the wheels of both sides, without its multiplier [m]
  bool open_loop = false;         ///< odometry of the commands instead of the measurements
  bool allow_multiple_cmd_vel_publishers = true;
  bool publish_cmd = false;                                        ///< publish the driven command on cmd_vel_out
  std::string odom_frame_id = "odom";                              ///< of the odometry
  std::optional<std::array<double, 6>> pose_covariance_diagonal;   ///< empty: that of the odometry
  std::optional<std::array<double, 6>> twist_covariance_diagonal;  ///< empty: that of the odometry
  std::string imu_topic = "imu/data";                              ///< in the namespace of the robot
  std::vector<std::string> unused;                                 ///< unknown keys
};

/// Reads all parameters of a controller's namespace. The keys of the drive loop are those of the node, except that
/// diff_drive_controller's keys replace robot.wheel_radius, robot.effective_track, robot.base_frame and the names of
/// the joints. Its limits become those of the drive gate where limits.* has no key: max_* for the acceleration, min_*
/// for the deceleration. Without a structure's keys the predictive one drives with its defaults, without plant_model.*
/// an assumed Jackal.
/// @param map the namespace; @param robot_description returns the URDF, or an empty text; called if wheel_radius or
/// wheel_separation are missing.
/// @throws ParameterError, one line.
RosControlParameters readRosControlParameters(ParameterMap map, const std::function<std::string()>& robot_description);

}  // namespace jackal_aic
