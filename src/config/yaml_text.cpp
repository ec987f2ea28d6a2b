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

void YamlWriter::field(const char* name, const std::vector<double>& value, Bounds, std::size_t, const char* unit,
                       Presence) {
  std::string list;
  for (const double item : value) list += (list.empty() ? "" : ", ") + yamlNumber(item);
  line(name, "[" + list + "]", unit);
}

void YamlWriter::line(const char* name, const std::string& value, const std::string& unit) {
  text_ += "  " + std::string(name) + ": " + value + (unit.empty() ? "" : "  # " + unit) + "\n";
}

}  // namespace jackal_aic
