#include <ros/ros.h>

#include "jackal_aic/config/text.hpp"
#include "jackal_aic/config/text_file.hpp"
#include "parameters/ros_parameters.hpp"
#include "plant_conversion.hpp"
#include "plant_node.hpp"
#include "process/shutdown.hpp"

namespace {

using jackal_aic::ParameterError;
using jackal_aic::ParameterMap;
using jackal_aic::sim::PlantNode;
using jackal_aic::sim::PlantNodeParameters;
using jackal_aic::sim::PlantParameters;

/// The URDF text from robot_description or, where that is not set, from a file.
std::string urdfText(const ros::NodeHandle& node, const std::string& urdf_file) {
  std::string urdf_xml = jackal_aic::robotDescription(node);
  if (!urdf_xml.empty()) return urdf_xml;
  if (urdf_file.empty())
    throw ParameterError("robot_description: missing, and there is no parameter urdf_file instead");
  return jackal_aic::readText(urdf_file);
}

void simulate(const ros::NodeHandle& node, const ros::NodeHandle& private_node) {
  ParameterMap map = jackal_aic::readRosParameters(private_node);
  const auto plant_parameters = jackal_aic::sim::readSimulatedRobot(map);
  const auto parameters = jackal_aic::readParameters<PlantNodeParameters>(map, "");
  map.refuseUnknown();
  PlantNode(node, private_node, urdfText(private_node, parameters.urdf_file), plant_parameters, parameters)
      .run(jackal_aic::StopRequest::requested);
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "plant_node", ros::init_options::NoSigintHandler);
  ros::NodeHandle node, private_node("~");  // kept to the end: without a handle roscpp shuts down and logs no more
  const jackal_aic::StopRequest stop;
  try {
    simulate(node, private_node);
  } catch (const std::exception& error) {
    ROS_FATAL("%s", jackal_aic::onOneLine(error.what()).c_str());
    return 1;
  }
  return 0;
}
