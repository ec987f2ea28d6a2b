// Damaged configuration files and URDFs: they are read, or refused in one line; nothing else happens.

#include <gtest/gtest.h>

#include <algorithm>

#include "fuzz.hpp"
#include "jackal_aic/config/urdf_geometry.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"
#include "parameters/node_parameters.hpp"
#include "plant_parameters.hpp"
#include "robot_model.hpp"

namespace jackal_aic::test {
namespace {

/// Counts what became of the inputs.
struct Outcomes {
  int accepted = 0;
  int refused = 0;
};

/// Runs a reader on an input. Anything but success or a one-line ParameterError fails the test.
template <class Read>
void readOrRefuse(const std::string& input, Outcomes& outcomes, Read read) {
  try {
    read(input);
    ++outcomes.accepted;
  } catch (const ParameterError& error) {
    ++outcomes.refused;
    const std::string what = error.what();
    EXPECT_EQ(what.find('\n'), std::string::npos) << "more than one line: " << what;
    EXPECT_FALSE(what.empty());
  } catch (const std::exception& error) {
    ADD_FAILURE() << "not a ParameterError: " << error.what() << "\n---\n" << input;
  }
}

TEST(FilesFuzz, ControllerFilesAreReadOrRefused) {
  std::string urdf = textOf("sim/urdf/jackal.urdf");
  const std::string robot = textOf("config/jackal.yaml"), plant_model = textOf("config/plant_model.yaml");
  Random random(1);
  Outcomes outcomes;
  for (int i = fuzzInputs(0.04); i > 0; --i) {
    const char* presets[] = {"standard", "improved", "predictive"};
    const std::string text = textOf(std::string("config/") + presets[random.below(3)] + ".yaml") + robot +
                             (random.chance(0.5) ? plant_model : "");
    readOrRefuse(random.damaged(text), outcomes, [&](const std::string& input) {
      ParameterMap map;
      addYamlText(input, "file", map);
      readNodeParameters(map, [&] { return urdf; });
    });
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(outcomes.accepted, 0);
  EXPECT_GT(outcomes.refused, outcomes.accepted / 10);
}

TEST(FilesFuzz, PlantFilesAreReadOrRefused) {
  const std::string text = textOf("config/plant.yaml");
  Random random(2);
  Outcomes outcomes;
  for (int i = fuzzInputs(0.04); i > 0; --i) {
    readOrRefuse(random.damaged(text), outcomes, [](const std::string& input) {
      ParameterMap map;
      addYamlText(input, "file", map);
      readParameters<sim::PlantParameters>(map, "plant");
      map.refuseUnknown();
    });
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(outcomes.accepted, 0);
  EXPECT_GT(outcomes.refused, 0);
}

TEST(FilesFuzz, UrdfsAreReadOrRefused) {
  const std::string text = textOf("sim/urdf/jackal.urdf");
  Random random(3);
  Outcomes geometry, model;
  for (int i = fuzzInputs(0.02); i > 0; --i) {
    const std::string input = random.damaged(text);
    readOrRefuse(input, geometry, [](const std::string& urdf) {
      const UrdfGeometry wheels =
          readUrdfGeometry(urdf, {"front_left_wheel", "rear_left_wheel"}, {"front_right_wheel", "rear_right_wheel"});
      EXPECT_GT(wheels.wheel_radius, 0.0);
      EXPECT_GT(wheels.track, 0.0);
      EXPECT_LT(wheels.wheel_radius, std::numeric_limits<double>::infinity());
      EXPECT_LT(wheels.track, std::numeric_limits<double>::infinity());
    });
    readOrRefuse(input, model, [](const std::string& urdf) { sim::readRobotModel(urdf); });
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(geometry.accepted, 0);
  EXPECT_GT(geometry.refused, 0);
  EXPECT_GT(model.refused, 0);
}

}  // namespace
}  // namespace jackal_aic::test
