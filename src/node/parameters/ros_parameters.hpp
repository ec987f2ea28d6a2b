#pragma once

/// @file
/// ParameterMap from the ROS parameter server.

#include <ros/node_handle.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include <string>

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic {

/// Parameters below a name, nested names joined by dots, by the rules of addYamlText(): 1e8, a text in YAML 1.1, is a
/// number. An empty map if the value is no struct.
/// @throws ParameterError, naming the key, for a value that is not a bool, number, string or flat list of numbers or
/// strings, or an empty struct.
ParameterMap parametersIn(XmlRpc::XmlRpcValue root);

/// Every parameter in the namespace of a node handle, nested names joined by dots ("~plant/seed" is plant.seed for the
/// private node handle). An empty namespace gives an empty map. @throws ParameterError as parametersIn().
ParameterMap readRosParameters(const ros::NodeHandle& node);

/// The URDF text in robot_description of the nearest enclosing namespace; empty if it is not set.
/// @throws ParameterError, naming the key, if it is empty or no text.
std::string robotDescription(const ros::NodeHandle& node);

/// The parameter tf_prefix of the nearest enclosing namespace, which separates the frames of several robots; empty
/// without one.
std::string tfPrefix(const ros::NodeHandle& node);

/// A frame with a prefix before it: "robot1" and "odom" give "robot1/odom". A frame that begins with a slash is its own
/// name without it.
std::string prefixedFrame(const std::string& prefix, const std::string& frame);

}  // namespace jackal_aic
