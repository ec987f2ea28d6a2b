#include "jackal_aic/config/text.hpp"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <fstream>

#include "jackal_aic/config/parameter_map.hpp"

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

std::string readText(const std::string& path, std::size_t most) {
  const auto refuse = [&path](const std::string& reason) { throw ParameterError(onOneLine(path) + ": " + reason); };
  using Type = std::filesystem::file_type;
  std::error_code error;
  const Type type = std::filesystem::status(path, error).type();
  if (error || type == Type::not_found) refuse("cannot be read");
  if (type == Type::directory) refuse("is a directory");
  // Opening a device may have side effects.
  if (type != Type::regular && type != Type::fifo) refuse("is a device or a socket, not a file");
  std::ifstream file(path, std::ios::binary);
  if (!file) refuse("cannot be read");
  std::string text;
  std::array<char, 4096> block{};
  while (file.read(block.data(), block.size()), file.gcount() > 0) {
    text.append(block.data(), static_cast<std::size_t>(file.gcount()));
    if (text.size() > most) refuse(fmt::format("more than {} MiB of text", most >> 20));
  }
  return text;
}

}  // namespace jackal_aic
