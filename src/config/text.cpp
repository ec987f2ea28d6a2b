#include "jackal_aic/config/text.hpp"

#include <fmt/format.h>

namespace jackal_aic {
namespace {

bool continues(char byte) { return (byte & 0xc0) == 0x80; }

}  // namespace

std::string onOneLine(const std::string& text) {
  std::string line;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '\t' || c == '\n' || c == '\r') {
      line += ' ';
    } else if (byte < 0x20 || byte == 0x7f) {
      line += fmt::format("\\x{:02x}", byte);
    } else {
      line += c;
    }
  }
  return line;
}

std::string shortened(const std::string& text, std::size_t longest) {
  if (text.size() <= longest) return onOneLine(text);
  std::size_t end = longest;
  while (end > 0 && continues(text[end])) --end;
  return onOneLine(text.substr(0, end)) + "...";
}

std::string quoted(const std::string& text) { return "'" + shortened(text) + "'"; }

}  // namespace jackal_aic
