#include "jackal_aic/config/yaml_parameters.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <optional>
#include <set>

#include "jackal_aic/config/text.hpp"
#include "jackal_aic/config/text_file.hpp"

namespace jackal_aic {
namespace {

// Beyond any configuration, and small enough for a recursive parser.
constexpr std::size_t kLargestText = std::size_t{1} << 20;  // bytes
constexpr int kDeepestText = 200;                           // brackets and dashes that are open at a time
constexpr int kDeepest = 32;                                // levels of keys
constexpr std::size_t kLongestKey = 1000;                   // characters; every value below it repeats them
constexpr std::size_t kMostNodes = 10000;                   // keys and values, with every alias expanded

std::optional<std::int64_t> wholeNumber(const std::string& text) {
  char* end = nullptr;
  errno = 0;
  const std::int64_t value = std::strtoll(text.c_str(), &end, 10);
  if (text.empty() || *end != '\0' || errno != 0) return std::nullopt;
  return value;
}

std::optional<double> number(const std::string& text) {
  if (text == ".nan" || text == ".NaN" || text == ".NAN") return std::numeric_limits<double>::quiet_NaN();
  if (text == ".inf" || text == "+.inf") return HUGE_VAL;
  if (text == "-.inf") return -HUGE_VAL;
  // The C library also takes hexadecimal numbers and the words nan and infinity, which are texts in YAML.
  if (text.empty() || text.find_first_not_of("0123456789+-.eE") != std::string::npos) return std::nullopt;
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (*end != '\0') return std::nullopt;
  return value;
}

/// Words that every reader of YAML 1.1, rosparam among them, takes for true or false.
std::optional<bool> truth(const std::string& text) {
  static const std::set<std::string> kTrue{"true", "True", "TRUE", "yes", "Yes", "YES", "on", "On", "ON"};
  static const std::set<std::string> kFalse{"false", "False", "FALSE", "no", "No", "NO", "off", "Off", "OFF"};
  if (kTrue.count(text) > 0) return true;
  if (kFalse.count(text) > 0) return false;
  return std::nullopt;
}

/// Digits with a leading zero. YAML 1.1, which rosparam reads, takes them for octal or for a text: 010 is 8 there.
bool hasLeadingZero(const std::string& text) {
  const std::size_t first = text.find_first_not_of("+-");
  return first != std::string::npos && first <= 1 && text[first] == '0' && text.size() > first + 1 &&
         text.find_first_not_of("0123456789", first) == std::string::npos;
}

/// A scalar with its type. A quoted one stays text even if it looks like a number; yaml-cpp tags it "!".
ParameterValue scalar(const YAML::Node& node) {
  const std::string& text = node.Scalar();
  if (node.Tag() == "!" || hasLeadingZero(text)) return text;
  if (const auto value = truth(text)) return *value;
  if (const auto value = wholeNumber(text)) return *value;
  if (const auto value = number(text)) return *value;
  return text;
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

/// Name of a key. An unclosed quote or bracket makes a key of the following lines, which is refused.
std::string nameOf(const YAML::Node& key) {
  if (!key.IsScalar()) throw ParameterError("a key is not a word");
  const std::string& name = key.Scalar();
  const auto control = std::find_if(name.begin(), name.end(), [](unsigned char c) { return std::iscntrl(c) != 0; });
  if (control != name.end()) {
    throw ParameterError("key '" + shortened(std::string(name.begin(), control)) +
                         "...': goes over more than one line");
  }
  return name;
}

/// Takes the values of one document into a map.
class Document {
 public:
  explicit Document(ParameterMap& map) : map_(map) {}

  void add(const YAML::Node& node, const std::string& key, int depth = 0) {
    if (depth > kDeepest) throw ParameterError(shortened(key) + ": more than 32 levels of keys");
    if (key.size() > kLongestKey) throw ParameterError(shortened(key) + ": more than 1000 characters");
    count(1);  // an empty one too, because aliases of aliases multiply
    if (node.IsMap()) {
      if (node.size() == 0) throw ParameterError(shortened(key) + " = {}: expected a value, or keys below it");
      for (const auto& entry : node) {
        const std::string name = nameOf(entry.first);
        add(entry.second, key.empty() ? name : key + "." + name, depth + 1);
      }
    } else if (node.IsSequence()) {
      count(node.size());
      set(key, list(node, key));
    } else if (node.IsScalar()) {
      set(key, scalar(node));
    } else {
      throw ParameterError(shortened(key) + ": has no value");
    }
  }

 private:
  void count(std::size_t nodes) {
    nodes_ += nodes;
    if (nodes_ > kMostNodes) throw ParameterError("more than 10000 keys and values");
  }

  void set(const std::string& key, ParameterValue value) {
    if (!given_.insert(key).second) throw ParameterError(shortened(key) + ": given twice");
    map_.set(key, std::move(value));
  }

  ParameterMap& map_;
  std::set<std::string> given_;
  std::size_t nodes_ = 0;
};

/// How many brackets of a text, and dashes and question marks at the beginning of one of its lines, are open at a time
/// at most. Quotes and comments count as text: no configuration has that many in them either.
int nesting(const std::string& text) {
  int brackets = 0, dashes = 0, deepest = 0;
  bool beginning = true;  // of a line
  for (char c : text) {
    if (c == '[' || c == '{') ++brackets;
    if (c == ']' || c == '}') brackets = std::max(0, brackets - 1);
    if (c == '\n') {
      beginning = true;
      dashes = 0;
    } else if (beginning && (c == '-' || c == '?' || c == ':')) {
      ++dashes;
    } else if (c != ' ' && c != '\t') {
      beginning = false;
    }
    deepest = std::max(deepest, brackets + dashes);
  }
  return deepest;
}

YAML::Node parsed(const std::string& text) {
  if (text.size() > kLargestText) throw ParameterError("more than 1 MiB of text");
  if (nesting(text) > kDeepestText) throw ParameterError("more than 200 levels of brackets or dashes");
  const std::vector<YAML::Node> documents = YAML::LoadAll(text);
  if (documents.size() > 1) throw ParameterError("more than one document (---)");
  return documents.empty() ? YAML::Node() : documents.front();
}

/// Runs a reader of YAML; its errors become one line that names where the text is from.
template <class Read>
void readYaml(const std::string& name, const Read& read) {
  constexpr std::size_t kLongestReason = 200;
  try {
    read();
  } catch (const ParameterError& error) {
    throw ParameterError(onOneLine(name) + ": " + error.what());
  } catch (const std::exception& error) {
    throw ParameterError(onOneLine(name) + ": not valid YAML: " + shortened(error.what(), kLongestReason));
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
