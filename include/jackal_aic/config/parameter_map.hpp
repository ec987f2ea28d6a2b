#pragma once

/// @file
/// Strict key/value parameters: every source (ROS parameter server, YAML file, `--set key=value`) becomes a
/// ParameterMap, and every parameter struct lists its fields once (`describe`), from which loading, validation and
/// `--set` follow.

#include <algorithm>
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

/// @throws ParameterError if a value that has to stay is not the one in force. @param key its full name.
void requireUnchanged(const char* key, double wanted, double running);

/// Text of a value as in YAML; a long one is cut.
std::string describe(const ParameterValue& value);

/// One field of a parameter struct.
struct Field {
  std::string name;                ///< last part of its key
  ParameterValue value;            ///< value in the struct
  std::optional<Bounds> bounds;    ///< of a number; empty for a whole number without an upper bound
  std::string unit;                ///< empty: none
  std::vector<std::string> words;  ///< the allowed words of a choice; else empty
  Presence presence;               ///< required or optional
  std::size_t most = 1;            ///< largest number of values of a list of numbers
};

/// Visitor of a parameter struct. A struct S is described by a function
/// `template <class V> void describeFields(V& visitor, S& s)` that calls visitor.field(...) once per field.
class FieldVisitor {
 public:
  virtual ~FieldVisitor() = default;

  /// Number in bounds.
  void field(const char* name, double& value, Bounds bounds, const char* unit, Presence presence) {
    visit({name, value, bounds, unit, {}, presence}, value);
  }

  /// Whole number in bounds.
  void field(const char* name, int& value, Bounds bounds, const char* unit, Presence presence) {
    visitAs<std::int64_t>({name, std::int64_t{value}, bounds, unit, {}, presence}, value);
  }

  /// Non-negative whole number without an upper bound (a random seed).
  void field(const char* name, std::uint64_t& value, const char* unit, Presence presence) {
    visitAs<std::int64_t>({name, static_cast<std::int64_t>(value), std::nullopt, unit, {}, presence}, value);
  }

  /// True or false, a text that is not empty, or a list of words that is not empty.
  template <class Value>
  void field(const char* name, Value& value, Presence presence) {
    visit({name, value, std::nullopt, "", {}, presence}, value);
  }

  /// One of a list of words, stored as its index.
  template <class Enum, std::size_t N>
  void field(const char* name, Enum& value, const std::array<const char*, N>& words, Presence presence) {
    std::string word = words[static_cast<std::size_t>(value)];
    visit({name, word, std::nullopt, "", {words.begin(), words.end()}, presence}, word);
    value = static_cast<Enum>(std::find(words.begin(), words.end(), word) - words.begin());
  }

  /// List of numbers, each in bounds, at least one and at most max_size.
  void field(const char* name, std::vector<double>& value, Bounds bounds, std::size_t max_size, const char* unit,
             Presence presence) {
    visit({name, value, bounds, unit, {}, presence, max_size}, value);
  }

 private:
  /// The new value of a field, of the same type; empty if it stays.
  virtual std::optional<ParameterValue> take(const Field& field) = 0;

  template <class Type, class Value>
  void visitAs(const Field& field, Value& value) {
    if (const auto given = take(field)) value = static_cast<Value>(std::get<Type>(*given));
  }
  template <class Value>
  void visit(const Field& field, Value& value) {
    visitAs<Value>(field, value);
  }
};

/// Reads the fields of a parameter struct from a map. field() throws ParameterError for a value of another type, NaN,
/// out of bounds, or missing though required.
class ParameterReader : public FieldVisitor {
 public:
  /// @param map source; @param prefix dotted prefix of the struct's keys, e.g. "controller".
  ParameterReader(ParameterMap& map, std::string prefix) : map_(map), prefix_(std::move(prefix)) {}

 private:
  std::optional<ParameterValue> take(const Field& field) override;

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

/// Lists the fields of a parameter struct with their values, in its order.
class FieldList : public FieldVisitor {
 public:
  std::vector<Field> fields;  ///< visited so far

 private:
  std::optional<ParameterValue> take(const Field& field) override {
    fields.push_back(field);
    return std::nullopt;
  }
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
