// What no controller can beat, and how near the predictive one comes to it. `experiments bounds` runs every case.

#include "bounds.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace jackal_aic::sim {
namespace {

const PackageFiles& files() {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return files;
}

const BoundedCase& caseOf(const std::string& name) {
  const auto& cases = boundedCases();
  const auto found = std::find_if(cases.begin(), cases.end(), [&](const BoundedCase& c) { return c.name == name; });
  if (found == cases.end()) throw ParameterError("no case " + name);
  return *found;
}

TEST(Bounds, SettlingIsDeadTimeAndAccelerationLimit) {
  const LoopSetup ground = loadSetup(files(), "predictive", "ground", {});
  EXPECT_NEAR(leastSettling(ground, {0.5, 0.0, 0.0}), 0.368, 5e-4);
  EXPECT_EQ(leastSettling(ground, {-0.5, 0.0, 0.0}), leastSettling(ground, {0.5, 0.0, 0.0}));
}

TEST(Bounds, OnTheGroundTheBodyTurnsAfterItsWheels) {
  const LoopSetup ground = loadSetup(files(), "predictive", "ground", {});
  const double wheels = leastSettling(ground.plant, 0.5 * 0.547 * 0.5);
  EXPECT_NEAR(wheels, 0.159, 5e-4);
  const double body = leastSettling(ground, {0.0, 0.0, 0.5});
  EXPECT_GT(body, wheels);
  EXPECT_LT(body, wheels + 0.02);
  EXPECT_EQ(leastSettling(ground, {0.0, 0.0, -0.5}), body);
}

TEST(Bounds, TheErrorThatNoActionReachesYetCountsAndThenTheWayBack) {
  const std::vector<double> constant(200, -0.1);
  EXPECT_NEAR(leastIae(constant, 0.1, 2.0), 0.1 * 0.1 + 0.1 * 0.1 / 4.0, 1e-12);
  EXPECT_NEAR(leastIae(constant, 0.05, 1e9), 0.1 * 0.05, 1e-9);
}

TEST(Bounds, NobodyBeatsThem) {
  for (const char* controller : {"diff_drive", "improved", "predictive"}) {
    for (const char* plant : {"box", "ground"}) {
      for (const char* name : {"0.5 m/s", "0.5 rad/s", "gain 1.2"}) {
        const BoundedFigure figure = runBounded(files(), controller, plant, caseOf(name));
        ASSERT_TRUE(figure.value) << controller << ", " << plant << ", " << name;
        EXPECT_GE(*figure.value, figure.bound - JackalPlant::kStep) << controller << ", " << plant << ", " << name;
      }
    }
  }
}

TEST(Bounds, ThePredictiveControllerKeepsItsBarsOnTheGround) {
  for (const char* name :
       {"0.1 m/s", "0.5 m/s", "1 m/s", "2 m/s", "0.5 rad/s", "1 rad/s", "gain 1.2", "load of 0.5 rad/s"}) {
    const BoundedCase& bounded = caseOf(name);
    const BoundedFigure figure = runBounded(files(), "predictive", "ground", bounded);
    ASSERT_TRUE(figure.value) << name;
    EXPECT_LE(*figure.value, barOf(files(), bounded, figure.bound)) << name;
  }
}

TEST(Bounds, TheOpenLoopDoesNothingAboutADisturbance) {
  // Else the disturbances show nothing.
  const BoundedFigure figure = runBounded(files(), "diff_drive", "ground", caseOf("gain 0.8"));
  EXPECT_NEAR(*figure.value, 2.0 * 0.2 * 0.5, 0.01);
}

}  // namespace
}  // namespace jackal_aic::sim
