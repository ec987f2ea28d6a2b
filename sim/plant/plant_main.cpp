#include <ros/ros.h>

#include "jackal_aic/config/text.hpp"
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

void simulate(const ros::NodeHandle& node, const ros::NodeHandle& private_node) {
  ParameterMap map = jackal_aic::readRosParameters(private_node);
  const auto plant_parameters = jackal_aic::sim::readSimulatedRobot(map);
  const auto parameters = jackal_aic::readParameters<PlantNodeParameters>(map, "");
  map.refuseUnknown();
  const std::string urdf = jackal_aic::robotDescription(private_node);
  if (urdf.empty()) throw ParameterError("robot_description: missing");
  PlantNode(node, private_node, urdf, plant_parameters, parameters).run(jackal_aic::StopRequest::requested);
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
