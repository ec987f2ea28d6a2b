#include "jackal_aic/config/yaml.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "jackal_aic/config/text.hpp"

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

/// Adds the values below a key of one document.
void add(const YAML::Node& node, const std::string& key, ParameterMap& document) {
  if (key.size() > kLongestKey) throw ParameterError(shortened(key) + ": more than 1000 characters");
  if (node.IsMap()) {
    if (node.size() == 0) throw ParameterError(shortened(key) + " = {}: expected a value, or keys below it");
    for (const auto& entry : node) {
      const auto name = entry.first.as<std::string>();
      add(entry.second, key.empty() ? name : key + "." + name, document);
    }
    return;
  }
  if (!node.IsSequence() && !node.IsScalar()) throw ParameterError(shortened(key) + ": has no value");
  if (document.has(key)) throw ParameterError(shortened(key) + ": given twice");
  document.set(key, node.IsSequence() ? list(node, key) : scalar(node));
}

YAML::Node parsed(const std::string& text) {
  if (text.size() > kLargestText) throw ParameterError("more than 1 MiB of text");
  const std::vector<YAML::Node> documents = YAML::LoadAll(text);
  if (documents.size() > 1) throw ParameterError("more than one document (---)");
  return documents.empty() ? YAML::Node() : documents.front();
}

/// Adds the values of a text below a key to a map; errors are one line that names where the text is from.
void addText(const std::string& text, const std::string& name, const std::string& key, ParameterMap& map) {
  try {
    const YAML::Node root = parsed(text);
    if (key.empty() && (!root.IsMap() || root.size() == 0)) {
      throw ParameterError("no keys found; expected 'key: value' lines");
    }
    ParameterMap document;
    add(root, key, document);
    map.add(document);
  } catch (const ParameterError& error) {
    throw ParameterError(onOneLine(name) + ": " + error.what());
  } catch (const std::exception& error) {
    throw ParameterError(onOneLine(name) + ": not valid YAML: " + shortened(error.what()));
  }
}

template <class Item>
std::string listed(const std::vector<Item>& items) {
  std::vector<std::string> texts;
  for (const Item& item : items) texts.push_back(yamlValue(item));
  return fmt::format("[{}]", fmt::join(texts, ", "));
}

}  // namespace

void addYamlText(const std::string& text, const std::string& name, ParameterMap& map) { addText(text, name, "", map); }

void setFromText(const std::string& key, const std::string& text, ParameterMap& map) {
  addText(text, key + " = " + quoted(text), key, map);
}

void addYamlFile(const std::string& path, ParameterMap& map) { addYamlText(readText(path, kLargestText), path, map); }

std::string yamlNumber(double value, int digits) {
  if (!std::isfinite(value)) throw ParameterError("a number to be written is not finite");
  const auto written = [](double number, int used) { return fmt::format("{:.{}g}", number, used); };
  const double rounded = std::strtod(written(value, digits).c_str(), nullptr);
  // The shortest text that is read back as it was; six digits keep 1000 from being 1e+03.
  int used = 6;
  while (used < 17 && std::strtod(written(rounded, used).c_str(), nullptr) != rounded) ++used;
  std::string number = written(rounded, used);
  if (number.find('.') == std::string::npos) number.insert(std::min(number.find('e'), number.size()), ".0");
  return number;
}

std::string yamlQuoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : onOneLine(text)) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + '"';
}

std::string yamlValue(const ParameterValue& value) {
  struct {
    std::string operator()(bool v) const { return v ? "true" : "false"; }
    std::string operator()(std::int64_t v) const { return fmt::format("{}", v); }
    std::string operator()(double v) const { return yamlNumber(v); }
    std::string operator()(const std::string& v) const { return yamlQuoted(v); }
    std::string operator()(const std::vector<double>& v) const { return listed(v); }
    std::string operator()(const std::vector<std::string>& v) const { return listed(v); }
  } text;
  return std::visit(text, value);
}

std::string yamlBlock(const std::string& prefix, const std::vector<Field>& fields) {
  std::string text = prefix + ":\n";
  for (const Field& field : fields) {
    const auto* word = std::get_if<std::string>(&field.value);
    if (word != nullptr && word->empty()) continue;
    const std::string value = word != nullptr && !field.words.empty() ? *word : yamlValue(field.value);
    text += fmt::format("  {}: {}{}{}\n", field.name, value, field.unit.empty() ? "" : "  # ", field.unit);
  }
  return text;
}

}  // namespace jackal_aic
