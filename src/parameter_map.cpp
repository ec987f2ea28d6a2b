#include "jackal_aic/parameter_map.hpp"

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <sstream>

#include "jackal_aic/text.hpp"

namespace jackal_aic {
namespace {

std::string number(double value) {
  std::ostringstream out;
  out.precision(10);
  out << value;
  return out.str();
}

std::string join(const std::vector<std::string>& words) {
  std::string text;
  for (const auto& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::string range(Bounds bounds, const char* unit) {
  std::string text = "[" + number(bounds.low) + ", " + number(bounds.high) + "]";
  if (*unit != '\0') text += std::string(" ") + unit;
  return text;
}

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

bool parseInteger(const std::string& text, std::int64_t& value) {
  if (text.empty()) return false;
  char* end = nullptr;
  errno = 0;
  value = std::strtoll(text.c_str(), &end, 10);
  return *end == '\0' && errno == 0;
}

bool parseNumber(const std::string& text, double& value) {
  if (text.empty()) return false;
  if (text == ".nan" || text == ".NaN" || text == ".NAN") {
    value = std::numeric_limits<double>::quiet_NaN();
    return true;
  }
  if (text == ".inf" || text == "-.inf" || text == "+.inf") {
    value = text[0] == '-' ? -HUGE_VAL : HUGE_VAL;
    return true;
  }
  char* end = nullptr;
  value = std::strtod(text.c_str(), &end);
  return *end == '\0';
}

const double* asNumber(const ParameterValue& value, double& storage) {
  if (const auto* real = std::get_if<double>(&value)) {
    storage = *real;
    return &storage;
  }
  if (const auto* whole = std::get_if<std::int64_t>(&value)) {
    storage = static_cast<double>(*whole);
    return &storage;
  }
  return nullptr;
}

void checkRange(const std::string& key, double value, Bounds bounds, const char* unit) {
  if (!(value >= bounds.low && value <= bounds.high)) {
    throw ParameterError(key + " = " + number(value) + ": must be in " + range(bounds, unit));
  }
}

}  // namespace

std::string describe(const ParameterValue& value) {
  struct {
    std::string operator()(bool v) const { return v ? "true" : "false"; }
    std::string operator()(std::int64_t v) const { return std::to_string(v); }
    std::string operator()(double v) const { return number(v); }
    std::string operator()(const std::string& v) const { return quoted(v); }
    std::string operator()(const std::vector<double>& v) const {
      std::vector<std::string> words;
      words.reserve(v.size());
      for (double x : v) words.push_back(number(x));
      return "[" + join(words) + "]";
    }
    std::string operator()(const std::vector<std::string>& v) const { return "[" + onOneLine(join(v)) + "]"; }
  } text;
  return std::visit(text, value);
}

void ParameterMap::set(const std::string& key, ParameterValue value) { values_[key] = std::move(value); }

void ParameterMap::setFromText(const std::string& key, const std::string& raw) {
  const std::string text = trimmed(raw);
  std::int64_t whole = 0;
  double real = 0.0;
  if (text == "true" || text == "false") {
    set(key, text == "true");
  } else if (parseInteger(text, whole)) {
    set(key, whole);
  } else if (parseNumber(text, real)) {
    set(key, real);
  } else if (text.size() >= 2 && text.front() == '[' && text.back() == ']') {
    std::vector<std::string> words;
    std::vector<double> numbers;
    std::stringstream items(text.substr(1, text.size() - 2));
    for (std::string item; std::getline(items, item, ',');) {
      words.push_back(trimmed(item));
      if (parseNumber(words.back(), real)) numbers.push_back(real);
    }
    if (numbers.size() == words.size()) {
      set(key, numbers);
    } else {
      set(key, words);
    }
  } else {
    set(key, text);
  }
}

bool ParameterMap::has(const std::string& key) const { return values_.count(key) > 0; }

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
    if (known_.count(entry.first) == 0) {
      throw ParameterError(onOneLine(entry.first) + " = " + describe(entry.second) +
                           ": unknown key; known keys: " + join(knownKeys()));
    }
  }
}

const ParameterValue* ParameterReader::lookup(const char* name, Presence presence, const std::string& expectation) {
  const ParameterValue* value = map_.take(key(name));
  if (value == nullptr && presence == Presence::required) {
    throw ParameterError(key(name) + ": missing; expected " + expectation);
  }
  return value;
}

void ParameterReader::field(const char* name, double& value, Bounds bounds, const char* unit, Presence presence) {
  const std::string expectation = "a number in " + range(bounds, unit);
  const ParameterValue* given = lookup(name, presence, expectation);
  if (given == nullptr) return;
  double real = 0.0;
  if (asNumber(*given, real) == nullptr) {
    throw ParameterError(key(name) + " = " + describe(*given) + ": expected " + expectation);
  }
  checkRange(key(name), real, bounds, unit);
  value = real;
}

void ParameterReader::field(const char* name, int& value, Bounds bounds, const char* unit, Presence presence) {
  const std::string expectation = "a whole number in " + range(bounds, unit);
  const ParameterValue* given = lookup(name, presence, expectation);
  if (given == nullptr) return;
  double real = 0.0;
  if (asNumber(*given, real) == nullptr || real != std::floor(real)) {
    throw ParameterError(key(name) + " = " + describe(*given) + ": expected " + expectation);
  }
  checkRange(key(name), real, bounds, unit);
  value = static_cast<int>(real);
}

void ParameterReader::field(const char* name, std::uint64_t& value, const char* unit, Presence presence) {
  const std::string expectation = "a whole number, 0 or more" + (*unit ? std::string(" ") + unit : std::string());
  const ParameterValue* given = lookup(name, presence, expectation);
  if (given == nullptr) return;
  const auto* whole = std::get_if<std::int64_t>(given);
  if (whole == nullptr || *whole < 0) {
    throw ParameterError(key(name) + " = " + describe(*given) + ": expected " + expectation);
  }
  value = static_cast<std::uint64_t>(*whole);
}

void ParameterReader::field(const char* name, bool& value, Presence presence) {
  const ParameterValue* given = lookup(name, presence, "true or false");
  if (given == nullptr) return;
  const auto* flag = std::get_if<bool>(given);
  if (flag == nullptr) throw ParameterError(key(name) + " = " + describe(*given) + ": expected true or false");
  value = *flag;
}

void ParameterReader::field(const char* name, std::string& value, Presence presence) {
  const ParameterValue* given = lookup(name, presence, "a text");
  if (given == nullptr) return;
  const auto* text = std::get_if<std::string>(given);
  if (text == nullptr || text->empty()) {
    throw ParameterError(key(name) + " = " + describe(*given) + ": expected a text that is not empty");
  }
  value = *text;
}

void ParameterReader::field(const char* name, std::vector<std::string>& value, Presence presence) {
  const ParameterValue* given = lookup(name, presence, "a list of words");
  if (given == nullptr) return;
  const auto* words = std::get_if<std::vector<std::string>>(given);
  if (words == nullptr || words->empty()) {
    throw ParameterError(key(name) + " = " + describe(*given) + ": expected a list of words that is not empty");
  }
  value = *words;
}

void ParameterReader::field(const char* name, std::vector<double>& value, Bounds bounds, std::size_t max_size,
                            const char* unit, Presence presence) {
  const std::string expectation = "a list of 1 to " + std::to_string(max_size) + " numbers in " + range(bounds, unit);
  const ParameterValue* given = lookup(name, presence, expectation);
  if (given == nullptr) return;
  const auto* numbers = std::get_if<std::vector<double>>(given);
  if (numbers == nullptr || numbers->empty() || numbers->size() > max_size) {
    throw ParameterError(key(name) + " = " + describe(*given) + ": expected " + expectation);
  }
  for (std::size_t i = 0; i < numbers->size(); ++i) {
    checkRange(key(name) + "[" + std::to_string(i) + "]", (*numbers)[i], bounds, unit);
  }
  value = *numbers;
}

int ParameterReader::choice(const char* name, const std::vector<std::string>& words, Presence presence) {
  const std::string expectation = "one of " + join(words);
  const ParameterValue* given = lookup(name, presence, expectation);
  if (given == nullptr) return -1;
  const auto* text = std::get_if<std::string>(given);
  for (std::size_t i = 0; text != nullptr && i < words.size(); ++i) {
    if (*text == words[i]) return static_cast<int>(i);
  }
  throw ParameterError(key(name) + " = " + describe(*given) + ": expected " + expectation);
}

}  // namespace jackal_aic
