#pragma once

/// @file
/// A recorded drive from a ROS bag.

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "jackal_aic/identification/plant_identification.hpp"
#include "jackal_aic/model/geometry.hpp"
#include "parameters/node_parameters.hpp"

namespace jackal_aic {

/// Topics of a bag for the identification.
struct BagTopics {
  /// jackal_msgs/Drive, geometry_msgs/Twist or TwistStamped; the time of recording counts.
  std::string commands = "/cmd_drive";
  std::string wheels = "/joint_states";     ///< sensor_msgs/JointState
  std::string imu = "/imu/data";            ///< sensor_msgs/Imu; may be absent
  std::string fixed_frames = "/tf_static";  ///< tf2_msgs/TFMessage; may be absent
  std::string frames = "/tf";               ///< tf2_msgs/TFMessage, with fixed and moving frames
  /// Orientation of the IMU in the base frame; without it that of the fixed frames counts. An IMU in the base frame
  /// needs neither; any other mounting has to be known.
  std::optional<Eigen::Quaterniond> imu_rotation;
  RobotNames robot;             ///< wheels, and the base frame, whose z axis points up
  GeometryParameters geometry;  ///< by which the robot's own controller turns a Twist into wheel speeds
};

/// Reads a bag. Drive messages in another mode than velocity count as zero, and a Twist as the wheel speeds that the
/// robot's own controller computes. Joint states without our wheels are ignored, as is the yaw rate of an IMU with
/// unknown mounting (DriveRecording::yaw_unknown).
/// @throws IdentificationError, one line, if the file is missing, no bag, truncated or empty, a topic is absent or of
///         another type, the joint states lack a velocity more than now and then, a message has no stamp, the stamps
///         of the wheels are of another clock than the recorder's, or more than one node published commands, or
///         speeds of our wheels.
DriveRecording readDriveBag(const std::string& path, const BagTopics& topics);

}  // namespace jackal_aic
