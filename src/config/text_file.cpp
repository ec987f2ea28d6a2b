#include "jackal_aic/config/text_file.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>

#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/config/text.hpp"

namespace jackal_aic {

std::string readText(const std::string& path, std::size_t most) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) throw ParameterError(onOneLine(path) + ": is a directory");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw ParameterError(onOneLine(path) + ": cannot be read");
  std::string text;
  std::array<char, 65536> block;
  while (text.size() < most && file) {
    file.read(block.data(), static_cast<std::streamsize>(std::min(block.size(), most - text.size())));
    text.append(block.data(), static_cast<std::size_t>(file.gcount()));
  }
  if (file.bad()) throw ParameterError(onOneLine(path) + ": cannot be read");
  return text;
}

}  // namespace jackal_aic
