#include "jackal_aic/config/parameter_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
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

std::string range(const Field& field) {
  return fmt::format("[{}, {}]{}{}", number(field.bounds->low), number(field.bounds->high),
                     field.unit.empty() ? "" : " ", field.unit);
}

/// The values that a field may have, in words.
std::string expectation(const Field& field) {
  if (!field.words.empty()) return fmt::format("one of {}", fmt::join(field.words, ", "));
  // As the types of ParameterValue.
  const std::array<std::string, std::variant_size_v<ParameterValue>> kinds{
      "true or false",
      "a whole number",
      "a number",
      "a text that is not empty",
      fmt::format("a list of 1 to {} numbers", field.most),
      "a list of words that is not empty"};
  const std::string kind = kinds[field.value.index()];
  if (field.bounds) return kind + " in " + range(field);
  return std::holds_alternative<std::int64_t>(field.value) ? kind + ", 0 or more" : kind;
}

std::optional<double> asNumber(const ParameterValue& value) {
  if (const auto* real = std::get_if<double>(&value)) return *real;
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return static_cast<double>(*whole);
  return std::nullopt;
}

void checkRange(const std::string& key, double value, const Field& field) {
  if (!(value >= field.bounds->low && value <= field.bounds->high)) {
    throw ParameterError(key + " = " + number(value) + ": must be in " + range(field));
  }
}

/// True if a value of the type of a field is one that it may have, but for the bounds of numbers.
bool suits(const Field& field, const ParameterValue& value) {
  if (const auto* text = std::get_if<std::string>(&value)) {
    const auto& words = field.words;
    if (!words.empty()) return std::find(words.begin(), words.end(), *text) != words.end();
    return !text->empty() || std::get<std::string>(field.value).empty();  // an optional text may be empty
  }
  if (const auto* numbers = std::get_if<std::vector<double>>(&value)) {
    return !numbers->empty() && numbers->size() <= field.most;
  }
  if (const auto* words = std::get_if<std::vector<std::string>>(&value)) return !words->empty();
  const auto* whole = std::get_if<std::int64_t>(&value);
  return whole == nullptr || *whole >= 0;
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

void requireUnchanged(const char* key, double wanted, double running) {
  if (wanted == running) return;
  throw ParameterError(fmt::format("{} = {:g}: must stay {:g} while the controller runs", key, wanted, running));
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

std::optional<ParameterValue> ParameterReader::take(const Field& field) {
  const std::string key = prefix_.empty() ? field.name : prefix_ + "." + field.name, expected = expectation(field);
  const ParameterValue* given = map_.take(key);
  if (given == nullptr) {
    if (field.presence == Presence::required) throw ParameterError(key + ": missing; expected " + expected);
    return std::nullopt;
  }
  const auto refuse = [&] { throw ParameterError(key + " = " + describe(*given) + ": expected " + expected); };
  if (const auto number = asNumber(*given); number && field.bounds && asNumber(field.value)) {
    const bool whole = std::holds_alternative<std::int64_t>(field.value);
    if (whole && *number != std::floor(*number)) refuse();
    checkRange(key, *number, field);
    if (whole) return static_cast<std::int64_t>(*number);
    return *number;
  }
  if (given->index() != field.value.index() || !suits(field, *given)) refuse();
  if (const auto* numbers = std::get_if<std::vector<double>>(given)) {
    for (std::size_t i = 0; i < numbers->size(); ++i) {
      checkRange(fmt::format("{}[{}]", key, i), (*numbers)[i], field);
    }
  }
  return *given;
}

}  // namespace jackal_aic
