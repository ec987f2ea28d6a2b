#include "jackal_aic/config/yaml_parameters.hpp"

#include <yaml-cpp/yaml.h>

#include <optional>
#include <set>

#include "jackal_aic/config/text.hpp"
#include "jackal_aic/config/text_file.hpp"

namespace jackal_aic {
namespace {

// Beyond any configuration. The keys of a map that is an alias of itself would grow without end.
constexpr std::size_t kLargestText = std::size_t{1} << 20;  // bytes
constexpr std::size_t kLongestKey = 1000;                   // characters

template <class Value>
std::optional<Value> as(const YAML::Node& node) {
  Value value{};
  return YAML::convert<Value>::decode(node, value) ? std::optional(value) : std::nullopt;
}

/// A scalar with its type. A quoted one stays text even if it looks like a number; yaml-cpp tags it "!".
ParameterValue scalar(const YAML::Node& node) {
  if (node.Tag() == "!") return node.Scalar();
  if (const auto value = as<bool>(node)) return *value;
  if (const auto value = as<std::int64_t>(node)) return *value;
  if (const auto value = as<double>(node)) return *value;
  return node.Scalar();
}

ParameterValue list(const YAML::Node& node, const std::string& key) {
  std::vector<double> numbers;
  std::vector<std::string> words;
  for (const YAML::Node& item : node) {
    if (!item.IsScalar()) throw ParameterError(shortened(key) + ": expected a flat list of numbers or of words");
    const ParameterValue value = scalar(item);
    if (const auto* word = std::get_if<std::string>(&value)) words.push_back(*word);
    if (const auto* whole = std::get_if<std::int64_t>(&value)) numbers.push_back(static_cast<double>(*whole));
    if (const auto* real = std::get_if<double>(&value)) numbers.push_back(*real);
  }
  if (numbers.size() == node.size()) return numbers;
  if (words.size() == node.size()) return words;
  throw ParameterError(shortened(key) + ": expected a flat list of numbers or of words, not of both");
}

/// Takes the values of one document into a map.
class Document {
 public:
  explicit Document(ParameterMap& map) : map_(map) {}

  void add(const YAML::Node& node, const std::string& key) {
    if (key.size() > kLongestKey) throw ParameterError(shortened(key) + ": more than 1000 characters");
    if (node.IsMap()) {
      if (node.size() == 0) throw ParameterError(shortened(key) + " = {}: expected a value, or keys below it");
      for (const auto& entry : node) {
        const auto name = entry.first.as<std::string>();
        add(entry.second, key.empty() ? name : key + "." + name);
      }
    } else if (node.IsSequence()) {
      set(key, list(node, key));
    } else if (node.IsScalar()) {
      set(key, scalar(node));
    } else {
      throw ParameterError(shortened(key) + ": has no value");
    }
  }

 private:
  void set(const std::string& key, ParameterValue value) {
    if (!given_.insert(key).second) throw ParameterError(shortened(key) + ": given twice");
    map_.set(key, std::move(value));
  }

  ParameterMap& map_;
  std::set<std::string> given_;
};

YAML::Node parsed(const std::string& text) {
  if (text.size() > kLargestText) throw ParameterError("more than 1 MiB of text");
  const std::vector<YAML::Node> documents = YAML::LoadAll(text);
  if (documents.size() > 1) throw ParameterError("more than one document (---)");
  return documents.empty() ? YAML::Node() : documents.front();
}

/// Runs a reader of YAML; its errors become one line that names where the text is from.
template <class Read>
void readYaml(const std::string& name, const Read& read) {
  try {
    read();
  } catch (const ParameterError& error) {
    throw ParameterError(onOneLine(name) + ": " + error.what());
  } catch (const std::exception& error) {
    throw ParameterError(onOneLine(name) + ": not valid YAML: " + shortened(error.what()));
  }
}

}  // namespace

void addYamlText(const std::string& text, const std::string& name, ParameterMap& map) {
  readYaml(name, [&] {
    const YAML::Node root = parsed(text);
    if (!root.IsMap() || root.size() == 0) throw ParameterError("no keys found; expected 'key: value' lines");
    Document(map).add(root, "");
  });
}

void setFromText(const std::string& key, const std::string& text, ParameterMap& map) {
  readYaml(key + " = " + quoted(text), [&] { Document(map).add(parsed(text), key); });
}

void addYamlFile(const std::string& path, ParameterMap& map) { addYamlText(readText(path, kLargestText), path, map); }

}  // namespace jackal_aic
