#include <ros/ros.h>

#include <algorithm>
#include <string>

#include "parameters/ros_parameters.hpp"
#include "process/controller_node.hpp"
#include "process/shutdown.hpp"
#include "process/wall_times.hpp"

namespace {

/// Waits for the URDF, which the robot's bringup sets. Empty if the node ends meanwhile.
std::string awaitRobotDescription(const ros::NodeHandle& node) {
  std::string urdf;
  while ((urdf = jackal_aic::robotDescription(node)).empty() && ros::ok() && !jackal_aic::StopRequest::requested()) {
    ROS_WARN_ONCE("No robot_description yet: start the robot's bringup first. Waiting for it");
    ros::WallDuration(jackal_aic::kCheckPeriod).sleep();
  }
  return urdf;
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "jackal_aic", ros::init_options::NoSigintHandler);
  ros::NodeHandle handle, private_handle("~");  // kept to the end: without a handle roscpp shuts down and logs no more
  jackal_aic::StopRequest stop;
  try {
    auto parameters = jackal_aic::readNodeParameters(jackal_aic::readRosParameters(private_handle),
                                                     [&] { return awaitRobotDescription(private_handle); });
    const std::string prefix = jackal_aic::tfPrefix(private_handle);
    parameters.robot.base_frame = jackal_aic::prefixedFrame(prefix, parameters.robot.base_frame);
    parameters.odometry.frame = jackal_aic::prefixedFrame(prefix, parameters.odometry.frame);
    const bool due = parameters.plant_model && !parameters.plant_model->identified;
    if (!parameters.preset.empty()) {
      ROS_INFO("Preset %s, parameters from %s", parameters.preset.c_str(), parameters.parameter_files.c_str());
    }
    ROS_LOG(due ? ros::console::levels::Warn : ros::console::levels::Info, ROSCONSOLE_DEFAULT_NAME, "%s",
            jackal_aic::describeRobot(parameters).c_str());
    jackal_aic::ControllerNode node(handle, private_handle, parameters);
    const bool suits = node.run(stop);
    // launch/controller.launch says whether roslaunch starts the node again when it ends.
    if (std::find(argv, argv + argc, std::string("--respawned")) != argv + argc) stop.waitIfNameTaken();
    if (!suits) return 1;
  } catch (const jackal_aic::ParameterError& error) {
    if (jackal_aic::StopRequest::requested()) return 0;
    ROS_FATAL("%s", error.what());
    return 1;
  }
  return 0;
}
