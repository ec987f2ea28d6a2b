#include "jackal_aic/config/yaml_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "jackal_aic/config/text.hpp"

namespace jackal_aic {
namespace {

template <class Item>
std::string listed(const std::vector<Item>& items) {
  std::vector<std::string> texts;
  for (const Item& item : items) texts.push_back(yamlValue(item));
  return fmt::format("[{}]", fmt::join(texts, ", "));
}

}  // namespace

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
