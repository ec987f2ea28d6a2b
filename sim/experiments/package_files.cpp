#include "package_files.hpp"

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <vector>

#include "jackal_aic/config/parameter_map.hpp"

namespace jackal_aic::sim {
namespace {

constexpr const char* kMarker = "sim/thesis/tables.yaml";

bool holdsPackage(const std::filesystem::path& directory) {
  std::error_code ignored;
  return std::filesystem::exists(directory / kMarker, ignored);
}

std::vector<std::filesystem::path> candidates() {
  std::vector<std::filesystem::path> list;
  if (const char* environment = std::getenv("JACKAL_AIC_SHARE")) list.emplace_back(environment);
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  // <install>/lib/jackal_aic/experiments
  if (!error) list.push_back(program.parent_path().parent_path().parent_path() / "share" / "jackal_aic");
  list.emplace_back(JACKAL_AIC_SOURCE_DIRECTORY);
  return list;
}

}  // namespace

PackageFiles::PackageFiles(const std::string& share) {
  const auto list = share.empty() ? candidates() : std::vector<std::filesystem::path>{share};
  for (const auto& directory : list) {
    if (!holdsPackage(directory)) continue;
    share_ = directory;
    return;
  }
  throw ParameterError("share = '" + list.front().string() + "': holds no " + kMarker +
                       "; give the package's directory with --share or JACKAL_AIC_SHARE");
}

std::string PackageFiles::path(const std::string& relative) const {
  const auto file = share_ / relative;
  if (!std::filesystem::exists(file)) throw ParameterError(file.string() + ": does not exist");
  return file.string();
}

std::string readText(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf())) throw ParameterError(path + ": cannot be read");
  return text.str();
}

void createDirectory(const std::string& directory) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (error) throw ParameterError("out = '" + directory + "': cannot be created: " + error.message());
}

}  // namespace jackal_aic::sim
