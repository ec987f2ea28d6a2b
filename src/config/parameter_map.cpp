#include "jackal_aic/config/parameter_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "jackal_aic/config/text.hpp"

namespace jackal_aic {
namespace {

std::string number(double value) { return fmt::format("{:.10g}", value); }

/// The first items of a list, and their number if some are left out.
template <class Item, class Text>
std::string listed(const std::vector<Item>& items, const Text& text) {
  std::vector<std::string> words;
  for (std::size_t i = 0; i < std::min(items.size(), std::size_t{8}); ++i) words.push_back(text(items[i]));
  if (items.size() > words.size()) words.push_back(fmt::format("... {} in all", items.size()));
  return fmt::format("[{}]", fmt::join(words, ", "));
}

std::string range(Bounds bounds, const char* unit) {
  return fmt::format("[{:.10g}, {:.10g}]{}{}", bounds.low, bounds.high, *unit == '\0' ? "" : " ", unit);
}

std::optional<double> asNumber(const ParameterValue& value) {
  if (const auto* real = std::get_if<double>(&value)) return *real;
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return static_cast<double>(*whole);
  return std::nullopt;
}

void checkRange(const std::string& key, double value, Bounds bounds, const char* unit) {
  if (!(value >= bounds.low && value <= bounds.high)) {
    throw ParameterError(key + " = " + number(value) + ": must be in " + range(bounds, unit));
  }
}

/// The three keys that have most characters in common with the beginning of a misspelt one.
std::vector<std::string> nearest(const std::string& key, std::vector<std::string> known) {
  const auto alike = [&key](const std::string& other) {
    return std::mismatch(key.begin(), key.end(), other.begin(), other.end()).first - key.begin();
  };
  std::stable_sort(known.begin(), known.end(),
                   [&](const std::string& a, const std::string& b) { return alike(a) > alike(b); });
  known.resize(std::min(known.size(), std::size_t{3}));
  return known;
}

}  // namespace

std::string describe(const ParameterValue& value) {
  struct {
    std::string operator()(bool v) const { return v ? "true" : "false"; }
    std::string operator()(std::int64_t v) const { return std::to_string(v); }
    std::string operator()(double v) const { return number(v); }
    std::string operator()(const std::string& v) const { return quoted(v); }
    std::string operator()(const std::vector<double>& v) const { return listed(v, number); }
    std::string operator()(const std::vector<std::string>& v) const { return listed(v, quoted); }
  } text;
  return std::visit(text, value);
}

void ParameterMap::set(const std::string& key, ParameterValue value) { values_[key] = std::move(value); }

void ParameterMap::add(const ParameterMap& others) {
  for (const auto& [key, value] : others.values_) set(key, value);
}

bool ParameterMap::has(const std::string& key) const { return values_.count(key) > 0; }

bool ParameterMap::hasSection(const std::string& prefix) const {
  const std::string section = prefix + ".";
  const auto first = values_.lower_bound(section);
  return first != values_.end() && first->first.compare(0, section.size(), section) == 0;
}

const ParameterValue* ParameterMap::take(const std::string& key) {
  declare(key);
  const auto entry = values_.find(key);
  return entry == values_.end() ? nullptr : &entry->second;
}

void ParameterMap::declare(const std::string& key) { known_.insert(key); }

std::vector<std::string> ParameterMap::keys() const {
  std::vector<std::string> list;
  for (const auto& entry : values_) list.push_back(entry.first);
  return list;
}

std::vector<std::string> ParameterMap::knownKeys() const { return {known_.begin(), known_.end()}; }

void ParameterMap::refuseUnknown() const {
  for (const auto& entry : values_) {
    if (known_.count(entry.first) > 0) continue;
    const auto below = known_.lower_bound(entry.first + ".");
    if (below != known_.end() && below->compare(0, entry.first.size() + 1, entry.first + ".") == 0) {
      throw ParameterError(entry.first + " = " + describe(entry.second) + ": expected keys below it, " + *below +
                           " for one");
    }
    const std::vector<std::string> candidates = nearest(entry.first, knownKeys());
    throw ParameterError(fmt::format("{} = {}: unknown key{}{}", shortened(entry.first), describe(entry.second),
                                     candidates.empty() ? "" : "; nearest known keys: ", fmt::join(candidates, ", ")));
  }
}

const ParameterValue* ParameterReader::lookup(const char* name, Presence presence, const std::string& expectation) {
  const ParameterValue* value = map_.take(key(name));
  if (value == nullptr && presence == Presence::required) {
    throw ParameterError(key(name) + ": missing; expected " + expectation);
  }
  return value;
}

template <class Type, class Suits>
const Type* ParameterReader::given(const char* name, Presence presence, const std::string& expectation, Suits suits) {
  const ParameterValue* value = lookup(name, presence, expectation);
  if (value == nullptr) return nullptr;
  const Type* typed = std::get_if<Type>(value);
  if (typed == nullptr || !suits(*typed)) refuse(name, *value, expectation);
  return typed;
}

void ParameterReader::refuse(const char* name, const ParameterValue& given, const std::string& expectation) const {
  throw ParameterError(key(name) + " = " + describe(given) + ": expected " + expectation);
}

std::optional<double> ParameterReader::numberIn(const char* name, Bounds bounds, const char* unit, Presence presence,
                                                bool whole) {
  const std::string expectation = (whole ? "a whole number in " : "a number in ") + range(bounds, unit);
  const ParameterValue* value = lookup(name, presence, expectation);
  if (value == nullptr) return std::nullopt;
  const std::optional<double> real = asNumber(*value);
  if (!real || (whole && *real != std::floor(*real))) refuse(name, *value, expectation);
  checkRange(key(name), *real, bounds, unit);
  return real;
}

void ParameterReader::field(const char* name, double& value, Bounds bounds, const char* unit, Presence presence) {
  value = numberIn(name, bounds, unit, presence, false).value_or(value);
}

void ParameterReader::field(const char* name, int& value, Bounds bounds, const char* unit, Presence presence) {
  value = static_cast<int>(numberIn(name, bounds, unit, presence, true).value_or(value));
}

void ParameterReader::field(const char* name, std::uint64_t& value, const char* unit, Presence presence) {
  const std::string expectation = "a whole number, 0 or more" + (*unit ? std::string(" ") + unit : std::string());
  const auto* whole = given<std::int64_t>(name, presence, expectation, [](std::int64_t v) { return v >= 0; });
  if (whole != nullptr) value = static_cast<std::uint64_t>(*whole);
}

void ParameterReader::field(const char* name, bool& value, Presence presence) {
  const auto* flag = given<bool>(name, presence, "true or false", [](bool) { return true; });
  if (flag != nullptr) value = *flag;
}

void ParameterReader::field(const char* name, std::string& value, Presence presence) {
  // What may be left out may be empty.
  const auto suits = [&value](const std::string& text) { return !text.empty() || value.empty(); };
  const auto* text = given<std::string>(name, presence, "a text that is not empty", suits);
  if (text != nullptr) value = *text;
}

void ParameterReader::field(const char* name, std::vector<std::string>& value, Presence presence) {
  const auto suits = [](const std::vector<std::string>& words) { return !words.empty(); };
  const auto* words = given<std::vector<std::string>>(name, presence, "a list of words that is not empty", suits);
  if (words != nullptr) value = *words;
}

void ParameterReader::field(const char* name, std::vector<double>& value, Bounds bounds, std::size_t max_size,
                            const char* unit, Presence presence) {
  const std::string expectation = fmt::format("a list of 1 to {} numbers in {}", max_size, range(bounds, unit));
  const auto suits = [max_size](const std::vector<double>& list) { return !list.empty() && list.size() <= max_size; };
  const auto* numbers = given<std::vector<double>>(name, presence, expectation, suits);
  if (numbers == nullptr) return;
  for (std::size_t i = 0; i < numbers->size(); ++i) {
    checkRange(fmt::format("{}[{}]", key(name), i), (*numbers)[i], bounds, unit);
  }
  value = *numbers;
}

int ParameterReader::choice(const char* name, const std::vector<std::string>& words, Presence presence) {
  const auto index = [&words](const std::string& word) { return std::find(words.begin(), words.end(), word); };
  const auto suits = [&](const std::string& word) { return index(word) != words.end(); };
  const auto* word = given<std::string>(name, presence, fmt::format("one of {}", fmt::join(words, ", ")), suits);
  return word == nullptr ? -1 : static_cast<int>(index(*word) - words.begin());
}

}  // namespace jackal_aic
