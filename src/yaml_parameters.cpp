#include "jackal_aic/yaml_parameters.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <sstream>

namespace jackal_aic {
namespace {

/// A quoted scalar stays text even if it looks like a number; yaml-cpp tags it "!".
void addScalar(const YAML::Node& node, const std::string& key, ParameterMap& map) {
  if (node.Tag() == "!") {
    map.set(key, node.Scalar());
  } else {
    map.setFromText(key, node.Scalar());
  }
}

void addList(const YAML::Node& node, const std::string& key, ParameterMap& map) {
  std::string text = "[";
  for (const YAML::Node& item : node) {
    if (!item.IsScalar()) throw ParameterError(key + ": expected a flat list of numbers or words");
    text += (text.size() > 1 ? "," : "") + item.Scalar();
  }
  map.setFromText(key, text + "]");
}

/// Name of a key. What an unclosed quote or bracket makes of the following lines is no name.
std::string nameOf(const YAML::Node& key) {
  auto name = key.as<std::string>();
  const auto control = std::find_if(name.begin(), name.end(), [](unsigned char c) { return std::iscntrl(c) != 0; });
  if (control != name.end()) {
    throw ParameterError("key '" + std::string(name.begin(), control) + "...': goes over more than one line");
  }
  return name;
}

void addNode(const YAML::Node& node, const std::string& key, ParameterMap& map) {
  if (node.IsMap()) {
    for (const auto& entry : node) {
      const std::string name = nameOf(entry.first);
      addNode(entry.second, key.empty() ? name : key + "." + name, map);
    }
  } else if (node.IsSequence()) {
    addList(node, key, map);
  } else if (node.IsScalar()) {
    addScalar(node, key, map);
  } else {
    throw ParameterError(key + ": has no value");
  }
}

}  // namespace

void addYamlText(const std::string& text, const std::string& name, ParameterMap& map) {
  try {
    const YAML::Node root = YAML::Load(text);
    if (!root.IsMap()) throw ParameterError("no keys found; expected 'key: value' lines");
    addNode(root, "", map);
  } catch (const ParameterError& error) {
    throw ParameterError(name + ": " + error.what());
  } catch (const YAML::Exception& error) {
    throw ParameterError(name + ": not valid YAML: " + error.what());
  }
}

void addYamlFile(const std::string& path, ParameterMap& map) {
  std::ifstream file(path);
  std::ostringstream text;
  const bool empty = file.peek() == std::ifstream::traits_type::eof();  // << of nothing fails
  if (!file.is_open() || (!empty && !(text << file.rdbuf()))) throw ParameterError(path + ": cannot be read");
  addYamlText(text.str(), path, map);
}

}  // namespace jackal_aic
