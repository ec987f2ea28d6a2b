#include "jackal_aic/config/text.hpp"

#include <algorithm>
#include <cctype>

namespace jackal_aic {

std::string onOneLine(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
  return text;
}

std::string shortened(const std::string& text) {
  constexpr std::size_t kLongest = 80;
  return onOneLine(text.size() > kLongest ? text.substr(0, kLongest) + "..." : text);
}

std::string quoted(const std::string& text) { return "'" + shortened(text) + "'"; }

}  // namespace jackal_aic
