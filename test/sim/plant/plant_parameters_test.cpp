#include "plant_parameters.hpp"

#include <gtest/gtest.h>

#include <string>

#include "../../complaint.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"

namespace jackal_aic::sim {
namespace {

PlantParameters fromYaml(const std::string& text) {
  ParameterMap map;
  addYamlText(text, "test", map);
  const auto parameters = readParameters<PlantParameters>(map, "plant");
  map.refuseUnknown();
  return parameters;
}

TEST(PlantParameters, ShippedFileListsEveryKeyAndNoOther) {
  ParameterMap map;
  addYamlFile(std::string(JACKAL_AIC_SOURCE_DIR) + "/config/plant.yaml", map);
  readParameters<PlantParameters>(map, "plant");
  EXPECT_EQ(map.keys(), map.knownKeys());
}

TEST(PlantParameters, NamesWhatIsWrong) {
  const auto refusal = [](const std::string& text) { return complaint([&] { fromYaml(text); }); };
  EXPECT_EQ(refusal("plant: {dead_time: -0.1}"), "plant.dead_time = -0.1: must be in [0, 2] s");
  EXPECT_EQ(refusal("plant: {support: boat}"), "plant.support = 'boat': expected one of ground, box");
  EXPECT_EQ(refusal("plant: {frictoin: 1}").find("plant.frictoin = 1: unknown key"), 0u);
}

}  // namespace
}  // namespace jackal_aic::sim
