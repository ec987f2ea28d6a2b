#include "jackal_aic/config/yaml_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace jackal_aic {

std::string yamlNumber(double value, int digits) {
  if (!std::isfinite(value)) throw ParameterError("a number to be written is not finite");
  char text[32];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  const double rounded = std::strtod(text, nullptr);
  // The shortest text that is read back as it was; six digits keep 1000 from being 1e+03.
  for (int used = 6; used <= 17; ++used) {
    std::snprintf(text, sizeof text, "%.*g", used, rounded);
    if (std::strtod(text, nullptr) == rounded) break;
  }
  std::string number = text;
  if (number.find('.') == std::string::npos) number.insert(std::min(number.find('e'), number.size()), ".0");
  return number;
}

std::string yamlQuoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += static_cast<unsigned char>(c) < ' ' || c == '\x7f' ? ' ' : c;
  }
  return quoted + '"';
}

std::string yamlValue(const ParameterValue& value) {
  const auto list = [](const auto& items, const auto& text) {
    std::string joined;
    for (const auto& item : items) joined += (joined.empty() ? "" : ", ") + text(item);
    return "[" + joined + "]";
  };
  struct {
    decltype(list) listed;
    std::string operator()(bool v) const { return v ? "true" : "false"; }
    std::string operator()(std::int64_t v) const { return std::to_string(v); }
    std::string operator()(double v) const { return yamlNumber(v); }
    std::string operator()(const std::string& v) const { return yamlQuoted(v); }
    std::string operator()(const std::vector<double>& v) const {
      return listed(v, [](double item) { return yamlNumber(item); });
    }
    std::string operator()(const std::vector<std::string>& v) const { return listed(v, yamlQuoted); }
  } text{list};
  return std::visit(text, value);
}

std::string yamlBlock(const std::string& prefix, const std::vector<Field>& fields) {
  std::string text = prefix + ":\n";
  for (const Field& field : fields) {
    const auto* word = std::get_if<std::string>(&field.value);
    if (word != nullptr && word->empty()) continue;
    const std::string value = word != nullptr && !field.words.empty() ? *word : yamlValue(field.value);
    text += "  " + field.name + ": " + value + (field.unit.empty() ? "" : "  # " + field.unit) + "\n";
  }
  return text;
}

}  // namespace jackal_aic
