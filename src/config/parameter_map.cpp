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
  if (known.size() > 3) known.resize(3);
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

void ParameterReader::refuse(const char* name, const ParameterValue& given, const std::string& expectation) const {
  throw ParameterError(key(name) + " = " + describe(given) + ": expected " + expectation);
}

void ParameterReader::field(const char* name, double& value, Bounds bounds, const char* unit, Presence presence) {
  const std::string expectation = "a number in " + range(bounds, unit);
  const ParameterValue* given = lookup(name, presence, expectation);
  if (given == nullptr) return;
  const std::optional<double> real = asNumber(*given);
  if (!real) refuse(name, *given, expectation);
  checkRange(key(name), *real, bounds, unit);
  value = *real;
}

void ParameterReader::field(const char* name, int& value, Bounds bounds, const char* unit, Presence presence) {
  const std::string expectation = "a whole number in " + range(bounds, unit);
  const ParameterValue* given = lookup(name, presence, expectation);
  if (given == nullptr) return;
  const std::optional<double> real = asNumber(*given);
  if (!real || *real != std::floor(*real)) refuse(name, *given, expectation);
  checkRange(key(name), *real, bounds, unit);
  value = static_cast<int>(*real);
}

void ParameterReader::field(const char* name, std::uint64_t& value, const char* unit, Presence presence) {
  const std::string expectation = "a whole number, 0 or more" + (*unit ? std::string(" ") + unit : std::string());
  const ParameterValue* given = lookup(name, presence, expectation);
  if (given == nullptr) return;
  const auto* whole = std::get_if<std::int64_t>(given);
  if (whole == nullptr || *whole < 0) refuse(name, *given, expectation);
  value = static_cast<std::uint64_t>(*whole);
}

void ParameterReader::field(const char* name, bool& value, Presence presence) {
  const ParameterValue* given = lookup(name, presence, "true or false");
  if (given == nullptr) return;
  const auto* flag = std::get_if<bool>(given);
  if (flag == nullptr) refuse(name, *given, "true or false");
  value = *flag;
}

void ParameterReader::field(const char* name, std::string& value, Presence presence) {
  const ParameterValue* given = lookup(name, presence, "a text");
  if (given == nullptr) return;
  const auto* text = std::get_if<std::string>(given);
  if (text == nullptr || (text->empty() && !value.empty()))
    refuse(name, *given, "a text that is not empty");  // what may be left out may be empty
  value = *text;
}

void ParameterReader::field(const char* name, std::vector<std::string>& value, Presence presence) {
  const ParameterValue* given = lookup(name, presence, "a list of words");
  if (given == nullptr) return;
  const auto* words = std::get_if<std::vector<std::string>>(given);
  if (words == nullptr || words->empty()) refuse(name, *given, "a list of words that is not empty");
  value = *words;
}

void ParameterReader::field(const char* name, std::vector<double>& value, Bounds bounds, std::size_t max_size,
                            const char* unit, Presence presence) {
  const std::string expectation = fmt::format("a list of 1 to {} numbers in {}", max_size, range(bounds, unit));
  const ParameterValue* given = lookup(name, presence, expectation);
  if (given == nullptr) return;
  const auto* numbers = std::get_if<std::vector<double>>(given);
  if (numbers == nullptr || numbers->empty() || numbers->size() > max_size) refuse(name, *given, expectation);
  for (std::size_t i = 0; i < numbers->size(); ++i) {
    checkRange(fmt::format("{}[{}]", key(name), i), (*numbers)[i], bounds, unit);
  }
  value = *numbers;
}

int ParameterReader::choice(const char* name, const std::vector<std::string>& words, Presence presence) {
  const std::string expectation = fmt::format("one of {}", fmt::join(words, ", "));
  const ParameterValue* given = lookup(name, presence, expectation);
  if (given == nullptr) return -1;
  const auto* text = std::get_if<std::string>(given);
  for (std::size_t i = 0; text != nullptr && i < words.size(); ++i) {
    if (*text == words[i]) return static_cast<int>(i);
  }
  refuse(name, *given, expectation);
}

}  // namespace jackal_aic
