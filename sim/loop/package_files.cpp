#include "package_files.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "jackal_aic/config/text_file.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"

namespace jackal_aic::sim {
namespace {

constexpr const char* kMarker = "sim/thesis/tables.yaml";
constexpr const char* kConfigurations[] = {"diff_drive", "standard",  "improved",   "tuned",       "predictive",
                                           "plant",      "plant_box", "plant_real", "plant_model", "jackal_model"};

bool holdsPackage(const std::filesystem::path& directory) {
  std::error_code ignored;
  return std::filesystem::exists(directory / kMarker, ignored);
}

std::vector<std::filesystem::path> candidates() {
  std::vector<std::filesystem::path> list;
  if (const char* environment = std::getenv("JACKAL_AIC_SHARE")) list.emplace_back(environment);
  // <install>/lib/libjackal_aic_experiments.so, which programs and Python share
  Dl_info library;
  if (dladdr(reinterpret_cast<const void*>(&candidates), &library) != 0) {
    list.push_back(std::filesystem::path(library.dli_fname).parent_path().parent_path() / "share" / "jackal_aic");
  }
  list.emplace_back(JACKAL_AIC_SOURCE_DIRECTORY);
  return list;
}

}  // namespace

PackageFiles::PackageFiles(const std::string& share) {
  const auto list = share.empty() ? candidates() : std::vector<std::filesystem::path>{share};
  const auto found = std::find_if(list.begin(), list.end(), holdsPackage);
  if (found == list.end()) {
    throw ParameterError("share = '" + list.front().string() + "': holds no " + kMarker +
                         "; give the package's directory with --share or JACKAL_AIC_SHARE");
  }
  share_ = *found;
  for (const std::string name : kConfigurations) addYamlFile(path("config/" + name + ".yaml"), configurations_[name]);
  urdf_ = readText(path("sim/urdf/jackal.urdf"));
}

const ParameterMap& PackageFiles::configuration(const std::string& name) const {
  const auto found = configurations_.find(name);
  if (found == configurations_.end()) throw ParameterError("config/" + name + ".yaml: no configuration of a loop");
  return found->second;
}

std::string PackageFiles::path(const std::string& relative) const {
  const auto file = share_ / relative;
  if (!std::filesystem::exists(file)) throw ParameterError(file.string() + ": does not exist");
  return file.string();
}

}  // namespace jackal_aic::sim
