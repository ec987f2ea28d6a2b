// The predictive controller on the calibrated plants: as fast as open loop, exact, and robust to a plant that is not
// its model.

#include <gtest/gtest.h>

#include "jackal_aic/yaml_parameters.hpp"
#include "loop_setup.hpp"
#include "plant_conversion.hpp"
#include "result_table.hpp"

namespace jackal_aic::sim {
namespace {

const PackageFiles& files() {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return files;
}

ResultRow step(const std::string& controller, const std::string& plant, double forward, double yaw_rate,
               const Overrides& overrides = {}) {
  return runSetup(loadSetup(files(), controller, plant, overrides), stepProfile(forward, yaw_rate, 4.0)).row;
}

class Nominal : public testing::TestWithParam<std::tuple<const char*, double>> {};

TEST_P(Nominal, IsAsFastAsOpenLoopAndExact) {
  const auto [plant, speed] = GetParam();
  const ResultRow ours = step("predictive", plant, speed, 0.0);
  const ResultRow open_loop = step("diff_drive", plant, speed, 0.0);
  ASSERT_TRUE(ours.stable && ours.settling_s && open_loop.settling_s);
  EXPECT_LE(*ours.settling_s, 1.10 * *open_loop.settling_s);
  EXPECT_LE(*ours.overshoot_pct, 5.0);
  EXPECT_LE(std::abs(*ours.steady_error_pct), 0.5);
}

INSTANTIATE_TEST_SUITE_P(Steps, Nominal,
                         testing::Combine(testing::Values("box", "ground"), testing::Values(0.1, 0.3, 0.5, 1.0)));

TEST(Predictive, IsFarFasterThanImprovedOnTheBox) {
  EXPECT_LE(*step("predictive", "box", 0.5, 0.0).settling_s, 0.6 * *step("improved", "box", 0.5, 0.0).settling_s);
}

struct Change {
  const char* key;
  const char* value;
};

class Perturbed : public testing::TestWithParam<std::tuple<const char*, Change>> {};

TEST_P(Perturbed, StaysStableExactAndQuick) {
  const auto [plant, change] = GetParam();
  const ResultRow row = step("predictive", plant, 0.5, 0.0, {{change.key, change.value}});
  ASSERT_TRUE(row.stable) << change.key << " = " << change.value;
  ASSERT_TRUE(row.settling_s) << change.key << " = " << change.value;
  EXPECT_LE(*row.settling_s, 0.8) << change.key << " = " << change.value;
  EXPECT_LE(std::abs(*row.steady_error_pct), 1.0) << change.key << " = " << change.value;
}

const Change kCommon[] = {{"plant.wheel_gain", "0.8"}, {"plant.wheel_gain", "1.2"}, {"plant.dead_time", "0.07"},
                          {"plant.dead_time", "0.15"}, {"plant.payload", "8"},      {"plant.friction", "0.25"},
                          {"plant.friction", "1.0"},   {"plant.slope", "5"},        {"plant.noise_scale", "5"}};
INSTANTIATE_TEST_SUITE_P(OnBothPlants, Perturbed,
                         testing::Combine(testing::Values("box", "ground"), testing::ValuesIn(kCommon)));

// Half and twice the calibrated lag of each plant.
const Change kBoxLags[] = {{"plant.motor_lag", "0.02275"}, {"plant.motor_lag", "0.091"}};
INSTANTIATE_TEST_SUITE_P(BoxLag, Perturbed, testing::Combine(testing::Values("box"), testing::ValuesIn(kBoxLags)));

TEST(PlantModelFile, IsThatOfTheSimulatedRobotOnItsGround) {
  ParameterMap map;
  addYamlFile(files().path("config/plant.yaml"), map);
  addYamlFile(files().path("config/plant_model.yaml"), map);
  const PlantModel robot = linearModel(readParameters<PlantParameters>(map, "plant"));
  const auto file = readParameters<PlantModel>(map, "plant_model");
  EXPECT_EQ(file.dead_time, robot.dead_time);
  EXPECT_EQ(file.lag, robot.lag);
  EXPECT_EQ(file.gain, robot.gain);
  EXPECT_EQ(file.velocity_loop_integral, robot.velocity_loop_integral);
  EXPECT_EQ(file.acceleration_limit, robot.acceleration_limit);
  EXPECT_EQ(file.sensor_rate, robot.sensor_rate);
  EXPECT_EQ(file.on_box, robot.on_box);
}

TEST(Predictive, LearnsTheSlipOfTheGround) {
  for (double turn : {0.2, 0.5, 1.0}) {
    const ResultRow row = step("predictive", "ground", 0.0, turn);
    ASSERT_TRUE(row.stable && row.settling_s);
    EXPECT_LE(std::abs(*row.steady_error_pct), 2.0) << turn << " rad/s";
    EXPECT_GT(std::abs(*step("improved", "ground", 0.0, turn).steady_error_pct), 2.0) << "the biased belief does not";
  }
}

}  // namespace
}  // namespace jackal_aic::sim
