#include "jackal_aic/config/text.hpp"

#include <fmt/format.h>

namespace jackal_aic {
namespace {

/// One character of a text.
struct Character {
  char32_t code;
  std::size_t bytes;
};

constexpr Character kNone{0xffffffff, 1};  // a byte that is not UTF-8

bool continues(const std::string& text, std::size_t at) { return at < text.size() && (text[at] & 0xc0) == 0x80; }

Character characterAt(const std::string& text, std::size_t at) {
  const auto first = static_cast<unsigned char>(text[at]);
  if (first < 0x80) return {first, 1};
  if (first < 0xc0 || first > 0xf4) return kNone;
  const std::size_t bytes = first < 0xe0 ? 2 : first < 0xf0 ? 3 : 4;
  char32_t code = first & (0x7f >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if (!continues(text, at + i)) return kNone;
    code = code << 6 | (text[at + i] & 0x3f);
  }
  constexpr char32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};  // of so many bytes; less is overlong
  const bool surrogate = code >= 0xd800 && code <= 0xdfff;
  if (code < kLeast[bytes] || surrogate || code > 0x10ffff) return kNone;
  return {code, bytes};
}

bool printable(char32_t code) {
  struct Range {
    char32_t first, last;
  };
  // Controls (C0, DEL and C1), marks and overrides of the direction of writing, line and paragraph separators, and
  // noncharacters.
  constexpr Range kUnprintable[] = {{0x00, 0x1f},     {0x7f, 0x9f},     {0x61c, 0x61c},   {0x200e, 0x200f},
                                    {0x2028, 0x202e}, {0x2066, 0x2069}, {0xfffe, 0xffff}, {0x110000, 0xffffffff}};
  for (const Range& range : kUnprintable) {
    if (code >= range.first && code <= range.last) return false;
  }
  return true;
}

}  // namespace

std::string onOneLine(const std::string& text) {
  std::string line;
  for (std::size_t at = 0; at < text.size();) {
    const Character character = characterAt(text, at);
    const std::string bytes = text.substr(at, character.bytes);
    at += character.bytes;
    if (bytes.find_first_of("\t\n\v\f\r") == 0) {
      line += ' ';
    } else if (printable(character.code)) {
      line += bytes;
    } else {
      for (const char byte : bytes) line += fmt::format("\\x{:02x}", static_cast<unsigned char>(byte));
    }
  }
  return line;
}

std::string shortened(const std::string& text, std::size_t longest) {
  if (text.size() <= longest) return onOneLine(text);
  // A character has at most three continuation bytes; more are invalid UTF-8.
  std::size_t end = longest;
  while (end > 0 && longest - end < 4 && continues(text, end)) --end;
  return onOneLine(text.substr(0, continues(text, end) ? longest : end)) + "...";
}

std::string quoted(const std::string& text) { return "'" + shortened(text) + "'"; }

}  // namespace jackal_aic
