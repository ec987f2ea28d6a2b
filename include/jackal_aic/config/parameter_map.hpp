#pragma once

/// @file
/// Strict key/value parameters: every source (ROS parameter server, YAML file, `--set key=value`) becomes a
/// ParameterMap, and every parameter struct lists its fields once (`describe`), from which loading, validation and
/// `--set` follow.

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace jackal_aic {

/// Bad configuration. what() is one line that names the key, the value and the bound.
class ParameterError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Value of one key as its source wrote it.
using ParameterValue =
    std::variant<bool, std::int64_t, double, std::string, std::vector<double>, std::vector<std::string>>;

/// Inclusive bounds of a number.
struct Bounds {
  double low;   ///< least value
  double high;  ///< largest value
};

/// Required or optional key.
enum class Presence { required, optional };

/// Flat parameters by dotted key ("controller.tau"). Remembers which keys were read, so that the rest can be refused.
class ParameterMap {
 public:
  /// Sets or replaces a key.
  void set(const std::string& key, ParameterValue value);

  /// Sets all keys that another map has.
  void add(const ParameterMap& others);

  /// True if the key was given.
  bool has(const std::string& key) const;

  /// True if a key of a section was given: "plant_model" has plant_model.lag.
  bool hasSection(const std::string& prefix) const;

  /// Value of a key, marked as read; nullptr if it was not given.
  const ParameterValue* take(const std::string& key);

  /// Declares a key as known without reading it (for the list of valid keys in messages).
  void declare(const std::string& key);

  /// Keys that were given, in alphabetical order.
  std::vector<std::string> keys() const;

  /// Keys declared or taken so far, in alphabetical order.
  std::vector<std::string> knownKeys() const;

  /// Throws ParameterError for the first key that was given and never taken, with the most similar known keys.
  void refuseUnknown() const;

 private:
  std::map<std::string, ParameterValue> values_;
  std::set<std::string> known_;
};

/// Text of a value as in YAML; a long one is cut.
std::string describe(const ParameterValue& value);

/// Reads the fields of a parameter struct from a map. A struct S is described by a function
/// `template <class V> void describeFields(V& visitor, S& s)` that calls visitor.field(...) once per field.
class ParameterReader {
 public:
  /// @param map source; @param prefix dotted prefix of the struct's keys, e.g. "controller".
  ParameterReader(ParameterMap& map, std::string prefix) : map_(map), prefix_(std::move(prefix)) {}

  /// Number in bounds. Throws ParameterError if missing though required, not a number, NaN, infinite or out of bounds.
  void field(const char* name, double& value, Bounds bounds, const char* unit, Presence presence);

  /// Whole number in bounds. Throws as for a number, and for a fraction.
  void field(const char* name, int& value, Bounds bounds, const char* unit, Presence presence);

  /// Non-negative whole number without an upper bound (a random seed). Throws as above.
  void field(const char* name, std::uint64_t& value, const char* unit, Presence presence);

  /// true or false. Throws if it is neither.
  void field(const char* name, bool& value, Presence presence);

  /// One of a list of words, stored as its index. Throws ParameterError with the list.
  template <class Enum, std::size_t N>
  void field(const char* name, Enum& value, const std::array<const char*, N>& words, Presence presence) {
    const std::vector<std::string> list(words.begin(), words.end());
    const int index = choice(name, list, presence);
    if (index >= 0) value = static_cast<Enum>(index);
  }

  /// Any text. Throws if it is not a string or is empty though required.
  void field(const char* name, std::string& value, Presence presence);

  /// List of words. Throws if it is not a list of strings or is empty.
  void field(const char* name, std::vector<std::string>& value, Presence presence);

  /// List of numbers, each in bounds, at least one and at most max_size. Throws as for a number, naming the index.
  void field(const char* name, std::vector<double>& value, Bounds bounds, std::size_t max_size, const char* unit,
             Presence presence);

 private:
  const ParameterValue* lookup(const char* name, Presence presence, const std::string& expectation);
  template <class Type, class Suits>
  const Type* given(const char* name, Presence presence, const std::string& expectation, Suits suits);
  std::optional<double> numberIn(const char* name, Bounds bounds, const char* unit, Presence presence, bool whole);
  [[noreturn]] void refuse(const char* name, const ParameterValue& given, const std::string& expectation) const;
  int choice(const char* name, const std::vector<std::string>& words, Presence presence);
  std::string key(const char* name) const { return prefix_.empty() ? name : prefix_ + "." + name; }

  ParameterMap& map_;
  std::string prefix_;
};

/// Reads struct S from the keys `prefix.*` of a map and returns it. Throws ParameterError.
template <class S>
S readParameters(ParameterMap& map, const std::string& prefix, S defaults = S{}) {
  ParameterReader reader(map, prefix);
  describeFields(reader, defaults);
  return defaults;
}

/// One field of a parameter struct, as describeFields() lists it.
struct Field {
  std::string name;                ///< last part of its key
  ParameterValue value;            ///< value in the struct
  std::optional<Bounds> bounds;    ///< of a number; empty for a whole number without an upper bound
  std::string unit;                ///< empty: none
  std::vector<std::string> words;  ///< the allowed words of a choice; else empty
  Presence presence;               ///< required or optional
};

/// Lists the fields of a parameter struct for writing: the opposite of ParameterReader.
class FieldList {
 public:
  /// One overload for each of ParameterReader's: a number in bounds.
  void field(const char* name, double value, Bounds bounds, const char* unit, Presence presence) {
    fields.push_back({name, value, bounds, unit, {}, presence});
  }
  /// A whole number in bounds.
  void field(const char* name, int value, Bounds bounds, const char* unit, Presence presence) {
    fields.push_back({name, std::int64_t{value}, bounds, unit, {}, presence});
  }
  /// A whole number from 0 on.
  void field(const char* name, std::uint64_t value, const char* unit, Presence presence) {
    fields.push_back({name, static_cast<std::int64_t>(value), std::nullopt, unit, {}, presence});
  }
  /// True or false, a text, or texts.
  template <class Value>
  void field(const char* name, const Value& value, Presence presence) {
    fields.push_back({name, value, std::nullopt, "", {}, presence});
  }
  /// Numbers in bounds.
  void field(const char* name, const std::vector<double>& value, Bounds bounds, std::size_t, const char* unit,
             Presence presence) {
    fields.push_back({name, value, bounds, unit, {}, presence});
  }
  /// One of several words.
  template <class Enum, std::size_t N>
  void field(const char* name, Enum value, const std::array<const char*, N>& words, Presence presence) {
    const std::string word = words[static_cast<std::size_t>(value)];
    fields.push_back({name, word, std::nullopt, "", {words.begin(), words.end()}, presence});
  }

  std::vector<Field> fields;  ///< in the order in which the struct lists them
};

/// The fields of a parameter struct with their values.
template <class S>
std::vector<Field> fieldsOf(S values) {
  FieldList list;
  describeFields(list, values);
  return list.fields;
}

/// Checks each field of a struct against its range; errors name the keys prefix.name, or name without a prefix. Throws
/// ParameterError.
template <class S>
void requireInRange(S values, const std::string& prefix) {
  ParameterMap map;
  const std::string before = prefix.empty() ? "" : prefix + ".";
  for (const Field& field : fieldsOf(values)) map.set(before + field.name, field.value);
  readParameters<S>(map, prefix);
}

}  // namespace jackal_aic
