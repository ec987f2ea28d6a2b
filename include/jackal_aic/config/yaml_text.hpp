#pragma once

/// @file
/// Parameters as YAML text that every reader takes for what it is. Readers differ: for YAML 1.1, which rosparam and
/// roslaunch speak, 1e+08 is a text; for YAML 1.2, and yaml-cpp, it is a number.

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic {

/// A number as YAML text that is a floating-point number for every reader of YAML 1.1 and 1.2, and of JSON: with a
/// point, and with a sign in the exponent (1000.0, 0.25, 1.0e+08).
/// @param digits most significant digits; with 17 every number is read back as it was. @throws ParameterError if the
/// number is not finite, which the formats write in ways of their own.
std::string yamlNumber(double value, int digits = 17);

/// A text as a quoted YAML scalar of one line, a text for every reader whatever it looks like. Control characters
/// become spaces.
std::string yamlQuoted(const std::string& text);

/// Writes the fields of a parameter struct as the lines of a YAML block, with their units as comments: the opposite of
/// reading them from a file. No field can be forgotten.
class YamlWriter {
 public:
  /// One overload for each of ParameterReader's that a written struct has. @throws ParameterError as yamlNumber().
  void field(const char* name, double value, Bounds, const char* unit, Presence) {
    line(name, yamlNumber(value), unit);
  }
  void field(const char* name, int value, Bounds, const char* unit, Presence) {
    line(name, std::to_string(value), unit);
  }
  void field(const char* name, const std::vector<double>& value, Bounds, std::size_t, const char* unit, Presence);
  template <class Enum, std::size_t N>
  void field(const char* name, Enum value, const std::array<const char*, N>& words, Presence) {
    line(name, words[static_cast<std::size_t>(value)], "");
  }

  /// The lines so far.
  std::string text() const { return text_; }

 private:
  void line(const char* name, const std::string& value, const std::string& unit);

  std::string text_;
};

/// A parameter struct as the YAML block `prefix:`. @throws ParameterError if a number is not finite.
template <class S>
std::string yamlBlock(const std::string& prefix, S values) {
  YamlWriter writer;
  describeFields(writer, values);
  return prefix + ":\n" + writer.text();
}

}  // namespace jackal_aic
