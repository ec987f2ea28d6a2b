#include "package_files.hpp"

#include <dlfcn.h>

#include <filesystem>
#include <map>

#include "jackal_aic/config/text.hpp"
#include "jackal_aic/config/yaml.hpp"

namespace jackal_aic::sim {
namespace {

std::filesystem::path shareDirectory() {
  Dl_info library;  // <install>/lib/libjackal_aic_simulation.so, which programs and Python share
  if (dladdr(reinterpret_cast<const void*>(&shareDirectory), &library) != 0) {
    auto installed = std::filesystem::path(library.dli_fname).parent_path().parent_path() / "share" / "jackal_aic";
    if (std::filesystem::exists(installed / "sim/thesis/tables.yaml")) return installed;
  }
  return JACKAL_AIC_SOURCE_DIRECTORY;
}

}  // namespace

std::string packageFile(const std::string& relative) {
  static const std::filesystem::path share = shareDirectory();
  const auto file = share / relative;
  if (!std::filesystem::exists(file)) throw ParameterError(file.string() + ": does not exist");
  return file.string();
}

const ParameterMap& configuration(const std::string& name) {
  static thread_local std::map<std::string, ParameterMap> read;
  const auto found = read.find(name);
  if (found != read.end()) return found->second;
  ParameterMap map;
  addYamlFile(packageFile("config/" + name + ".yaml"), map);
  return read.emplace(name, std::move(map)).first->second;
}

const std::string& robotUrdf() {
  static const std::string text = readText(packageFile("sim/urdf/jackal.urdf"));
  return text;
}

}  // namespace jackal_aic::sim
