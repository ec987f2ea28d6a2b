#include "package_files.hpp"

#include <dlfcn.h>

#include "jackal_aic/config/text_file.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"

namespace jackal_aic::sim {
namespace {

constexpr const char* kMarker = "sim/thesis/tables.yaml";
constexpr const char* kConfigurations[] = {"diff_drive", "standard",  "improved",   "tuned",       "predictive",
                                           "plant",      "plant_box", "plant_real", "plant_model", "jackal_model"};

}  // namespace

PackageFiles::PackageFiles() : share_(JACKAL_AIC_SOURCE_DIRECTORY) {
  Dl_info library;  // <install>/lib/libjackal_aic_simulation.so, which programs and Python share
  if (dladdr(reinterpret_cast<const void*>(&kConfigurations), &library) != 0) {
    const auto installed =
        std::filesystem::path(library.dli_fname).parent_path().parent_path() / "share" / "jackal_aic";
    if (std::filesystem::exists(installed / kMarker)) share_ = installed;
  }
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
