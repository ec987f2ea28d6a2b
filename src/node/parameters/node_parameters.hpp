#pragma once

/// @file
/// Configuration of the controller node, checked as a whole before a topic is opened. Also the YAML files of a
/// controller and of a plant model, for the command line tools. No ROS.

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "jackal_aic/certificate/linear_loop.hpp"
#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/safety/drive_loop.hpp"

namespace jackal_aic {

/// Where the wheel commands go.
enum class OutputMode {
  cmd_drive,  ///< jackal_msgs/Drive on /cmd_drive
  twist,      ///< geometry_msgs/Twist on /cmd_vel, for twist_mux and the stock velocity controller
  gazebo      ///< std_msgs/Float64 on /jackal_left_wheel/command and /jackal_right_wheel/command
};

/// Words of OutputMode, in the order of the enumerators.
inline constexpr std::array<const char*, 3> kOutputModeNames{"cmd_drive", "twist", "gazebo"};

/// Names that tie the controller to a robot. YAML prefix `robot` (with GeometryParameters).
struct RobotNames {
  std::vector<std::string> left_wheel_joints{"front_left_wheel", "rear_left_wheel"};     ///< joints averaged to omega_L
  std::vector<std::string> right_wheel_joints{"front_right_wheel", "rear_right_wheel"};  ///< joints averaged to omega_R
  std::string base_frame = "base_link";                                                  ///< frame of the body velocity
  double track_multiplier = 1.5;     ///< effective track / geometric track, used when effective_track is not given
  double pairing_tolerance = 0.015;  ///< largest difference between the stamps of a wheel and an IMU sample [s]
};

/// Lists the fields of RobotNames with unit and range.
template <class Visitor>
void describeFields(Visitor& v, RobotNames& p) {
  v.field("left_wheel_joints", p.left_wheel_joints, Presence::optional);
  v.field("right_wheel_joints", p.right_wheel_joints, Presence::optional);
  v.field("base_frame", p.base_frame, Presence::optional);
  v.field("track_multiplier", p.track_multiplier, {0.5, 5.0}, "", Presence::optional);
  v.field("pairing_tolerance", p.pairing_tolerance, {0.0, 0.2}, "s", Presence::optional);
}

/// Outputs of the odometry. YAML prefix `odometry`.
struct OdometryParameters {
  bool publish = true;         ///< on the topic odom
  bool tf = false;             ///< as a transform too, if no other node publishes it
  std::string frame = "odom";  ///< of the pose
};

/// Lists the fields of OdometryParameters.
template <class Visitor>
void describeFields(Visitor& v, OdometryParameters& p) {
  v.field("publish", p.publish, Presence::optional);
  v.field("tf", p.tf, Presence::optional);
  v.field("frame", p.frame, Presence::optional);
}

/// How the node runs. YAML keys without a prefix.
struct NodeOptions {
  OutputMode output = OutputMode::cmd_drive;  ///< where the commands go: jackal_msgs/Drive on /cmd_drive, Twist on
                                              ///< /cmd_vel, or Float64 per wheel
  bool allow_other_publishers = false;        ///< drive although other nodes publish on the topics of the commands
  bool allow_multiple_set_points = false;     ///< accept set points although more than one node publishes them
  bool publish_inputs = false;                ///< publish every input of the controller, for an exact replay
  std::string preset;           ///< name of the preset, for the log and the tools; set by the launch files
  std::string parameter_files;  ///< sources of the parameters, for the log
};

/// Lists the fields of NodeOptions.
template <class Visitor>
void describeFields(Visitor& v, NodeOptions& p) {
  v.field("output", p.output, kOutputModeNames, Presence::optional);
  v.field("allow_other_publishers", p.allow_other_publishers, Presence::optional);
  v.field("allow_multiple_set_points", p.allow_multiple_set_points, Presence::optional);
  v.field("publish_inputs", p.publish_inputs, Presence::optional);
  v.field("preset", p.preset, Presence::optional);
  v.field("parameter_files", p.parameter_files, Presence::optional);
}

/// All parameters of the controller node. The plant model is for the certificate too.
struct NodeParameters : DriveParameters, NodeOptions {
  RobotNames robot;
  OdometryParameters odometry;
  std::string slip_file;   ///< absolute path of the YAML file (key slip.file) in which the predictive structure keeps
                           ///< what it learns; empty: it starts from the configured values each time
  std::string robot_name;  ///< name of the robot in the plant model; empty without one
};

/// One line on the configured robot, the assumptions about it, and whether `identify` is due.
std::string describeRobot(const NodeParameters& parameters);

/// Reads every key of a node's configuration, for the node, the tools and the experiments. Checks ranges only; geometry
/// that is not given stays.
/// @param parameters values of keys that are not given; except gains, variances and settings of the fault detection,
/// which have their own defaults. @throws ParameterError as readNodeParameters(), but for unknown keys, which the
/// caller checks.
NodeParameters readConfiguration(ParameterMap& map, NodeParameters parameters = {});

/// Reads and checks all parameters. Geometry that the map does not give is read from the robot's URDF. The given keys
/// select the structure: controller.* the thesis', predictive.* (with plant_model.*) the predictive one, diff_drive.*
/// the open-loop baseline.
/// @param map parameters of the node; @param robot_description returns the URDF text, or an empty text if there is
/// none; called only if geometry is missing.
/// @throws ParameterError, one line, if a key is missing, unknown, of the wrong type or out of range, or if the keys
/// belong to two structures or to none. Also if a needed URDF is absent or unusable, if the belief update diverges, or
/// if the closed loop is unstable on the plant model (plant_model.*, which the thesis' structure does not need).
NodeParameters readNodeParameters(ParameterMap map, const std::function<std::string()>& robot_description);

/// Parameters as YAML text that readNodeParameters() reads back without a URDF. Without slip_file, which belongs to a
/// machine. @throws ParameterError as yamlNumber().
std::string configurationText(const NodeParameters& parameters);

/// Gains of a structure that can be certified, and changed while it drives.
using Gains = decltype(GainsInput::gains);

/// The closed loop of these gains on a robot. @throws ParameterError as LinearLoop, and for the open-loop baseline.
LinearLoop closedLoop(const NodeParameters& parameters, const PlantModel& robot);

/// Checks gains by themselves, and their closed loop on the plant model, which the predictive structure needs.
/// @throws ParameterError, one line; never for the open-loop baseline.
void requireStable(const NodeParameters& parameters);

/// The YAML text of gains and of the sensors' variances that belong to them.
std::string gainsText(const Gains& gains);

/// What gainsText() wrote. @throws ParameterError if it is no such text.
Gains readGainsText(const std::string& text);

/// Reads a preset, or the whole configuration of a controller node, without its checks and without a URDF.
/// @throws ParameterError naming file and key.
NodeParameters readControllerFile(const std::string& path);

/// Reads a plant model (keys plant_model.*, as `identify` writes them). @throws ParameterError naming file and key,
/// also if the file has no such keys.
PlantModel readPlantModelFile(const std::string& path);

}  // namespace jackal_aic
