#include "ros_parameters.hpp"

#include <XmlRpcValue.h>

#include <cstdint>
#include <string>
#include <vector>

namespace jackal_aic {
namespace {

using XmlRpc::XmlRpcValue;

double number(XmlRpcValue& value) {
  return value.getType() == XmlRpcValue::TypeInt ? static_cast<int>(value) : static_cast<double>(value);
}

ParameterValue listOf(XmlRpcValue& list, const std::string& key) {
  std::vector<double> numbers;
  std::vector<std::string> words;
  for (int i = 0; i < list.size(); ++i) {
    const XmlRpcValue::Type type = list[i].getType();
    if (type == XmlRpcValue::TypeInt || type == XmlRpcValue::TypeDouble) numbers.push_back(number(list[i]));
    if (type == XmlRpcValue::TypeString) words.push_back(static_cast<std::string&>(list[i]));
  }
  const auto size = static_cast<std::size_t>(list.size());
  if (numbers.size() == size) return numbers;
  if (words.size() == size) return words;
  if (numbers.size() + words.size() < size) throw ParameterError(key + ": expected a flat list of numbers or of words");
  throw ParameterError(key + ": expected a flat list of numbers or of words; '" + words.front() +
                       "' is a word for YAML 1.1, which takes 1.0e+8, but not 1e8, for a number");
}

void addValue(XmlRpcValue& value, const std::string& key, ParameterMap& map) {
  switch (value.getType()) {
    case XmlRpcValue::TypeStruct:
      for (auto& entry : value) addValue(entry.second, key.empty() ? entry.first : key + "." + entry.first, map);
      break;
    case XmlRpcValue::TypeBoolean:
      map.set(key, static_cast<bool>(value));
      break;
    case XmlRpcValue::TypeInt:
      map.set(key, static_cast<std::int64_t>(static_cast<int>(value)));
      break;
    case XmlRpcValue::TypeDouble:
      map.set(key, static_cast<double>(value));
      break;
    case XmlRpcValue::TypeString:
      map.set(key, static_cast<std::string&>(value));
      break;
    case XmlRpcValue::TypeArray:
      map.set(key, listOf(value, key));
      break;
    default:
      throw ParameterError(key + ": expected true or false, a number, a text or a flat list");
  }
}

}  // namespace

ParameterMap readRosParameters(const ros::NodeHandle& node) {
  ParameterMap map;
  XmlRpcValue root;
  if (node.getParam(node.getNamespace(), root) && root.getType() == XmlRpcValue::TypeStruct) addValue(root, "", map);
  return map;
}

std::string robotDescription(const ros::NodeHandle& node) {
  std::string key, urdf_xml;
  if (node.searchParam("robot_description", key)) node.getParam(key, urdf_xml);
  return urdf_xml;
}

}  // namespace jackal_aic
