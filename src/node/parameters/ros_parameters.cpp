#include "parameters/ros_parameters.hpp"

#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "jackal_aic/config/text.hpp"

namespace jackal_aic {
namespace {

using XmlRpc::XmlRpcValue;

/// A text, or the number in it: rosparam, with YAML 1.1, reads 1.0e+8 as a number but 1e8 as a text.
ParameterValue textOf(XmlRpcValue& value) {
  const auto& text = static_cast<std::string&>(value);
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  const bool exponential =
      text.find_first_of("eE") != std::string::npos && text.find_first_not_of("0123456789+-.eE") == std::string::npos;
  if (exponential && end != text.c_str() && *end == '\0') return number;
  return text;
}

ParameterValue scalarOf(XmlRpcValue& value, const std::string& key) {
  const XmlRpcValue::Type type = value.getType();
  if (type == XmlRpcValue::TypeBoolean) return static_cast<bool>(value);
  if (type == XmlRpcValue::TypeInt) return static_cast<std::int64_t>(static_cast<int>(value));
  if (type == XmlRpcValue::TypeDouble) return static_cast<double>(value);
  if (type == XmlRpcValue::TypeString) return textOf(value);
  throw ParameterError(shortened(key) + ": expected true or false, a number, a text or a flat list");
}

ParameterValue listOf(XmlRpcValue& list, const std::string& key) {
  std::vector<double> numbers;
  std::vector<std::string> words;
  for (int i = 0; i < list.size(); ++i) {
    const ParameterValue item = scalarOf(list[i], key);
    if (const auto* whole = std::get_if<std::int64_t>(&item)) numbers.push_back(static_cast<double>(*whole));
    if (const auto* real = std::get_if<double>(&item)) numbers.push_back(*real);
    if (const auto* word = std::get_if<std::string>(&item)) words.push_back(*word);
  }
  const auto size = static_cast<std::size_t>(list.size());
  if (numbers.size() == size) return numbers;
  if (words.size() == size) return words;
  throw ParameterError(shortened(key) + ": expected a flat list of numbers or of words");
}

void addValue(XmlRpcValue& value, const std::string& key, ParameterMap& map) {
  if (value.getType() == XmlRpcValue::TypeArray) return map.set(key, listOf(value, key));
  if (value.getType() != XmlRpcValue::TypeStruct) return map.set(key, scalarOf(value, key));
  // As in a file; a namespace without any parameter is left out.
  if (value.size() == 0 && !key.empty())
    throw ParameterError(shortened(key) + " = {}: expected a value, or keys below it");
  for (auto& entry : value) addValue(entry.second, key.empty() ? entry.first : key + "." + entry.first, map);
}

}  // namespace

ParameterMap parametersIn(XmlRpcValue root) {
  ParameterMap map;
  if (root.getType() == XmlRpcValue::TypeStruct) addValue(root, "", map);
  return map;
}

ParameterMap readRosParameters(const ros::NodeHandle& node) {
  XmlRpcValue root;
  return node.getParam(node.getNamespace(), root) ? parametersIn(root) : ParameterMap();
}

std::string robotDescription(const ros::NodeHandle& node) {
  std::string key, urdf;
  if (!node.searchParam("robot_description", key)) return "";
  if (node.getParam(key, urdf) && !urdf.empty()) return urdf;
  throw ParameterError(shortened(key) + ": expected the text of a URDF; it is empty, or no text");
}

std::string tfPrefix(const ros::NodeHandle& node) {
  std::string key, prefix;
  if (node.searchParam("tf_prefix", key)) node.getParam(key, prefix);
  return prefix;
}

std::string prefixedFrame(const std::string& prefix, const std::string& frame) {
  if (!frame.empty() && frame.front() == '/') return frame.substr(1);
  const std::size_t begin = prefix.find_first_not_of('/'), end = prefix.find_last_not_of('/');
  if (begin == std::string::npos) return frame;
  return prefix.substr(begin, end - begin + 1) + "/" + frame;
}

}  // namespace jackal_aic
