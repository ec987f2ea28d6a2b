#include "parameters/node_parameters.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <regex>
#include <set>
#include <type_traits>

#include "../complaint.hpp"
#include "../repository.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"
#include "parameters/live_parameters.hpp"
#include "plant_parameters.hpp"

namespace jackal_aic {
namespace {

const std::string kSource = JACKAL_AIC_SOURCE_DIR;

std::string jackalUrdf() { return textOf("sim/urdf/jackal.urdf"); }

ParameterMap shipped(const std::string& preset) {
  ParameterMap map;
  addYamlFile(kSource + "/config/jackal.yaml", map);
  addYamlFile(kSource + "/config/" + preset + ".yaml", map);
  return map;
}

std::string refusal(const ParameterMap& map, const std::string& urdf) {
  const std::string said = complaint([&] { readNodeParameters(map, [&] { return urdf; }); });
  EXPECT_NE(said, "") << "accepted";
  return said;
}

/// Expects that a preset with a plant model is refused when a key is another, with these words.
void expectRefused(const std::string& preset, const std::string& key, const ParameterValue& value,
                   const std::string& said, const char* model = "plant_model") {
  ParameterMap map = shipped(preset);
  addYamlFile(kSource + "/config/" + model + ".yaml", map);
  map.set(key, value);
  EXPECT_NE(refusal(map, jackalUrdf()).find(said), std::string::npos) << refusal(map, jackalUrdf());
}

TEST(NodeParameters, ShippedFilesAreCompleteAndValid) {
  for (const char* preset : {"standard", "improved", "tuned"}) {
    const NodeParameters parameters = readNodeParameters(shipped(preset), jackalUrdf);
    EXPECT_DOUBLE_EQ(parameters.geometry.effective_track, 0.5621);
    EXPECT_DOUBLE_EQ(parameters.geometry.wheel_radius, 0.098) << "from the URDF";
    EXPECT_EQ(parameters.output, OutputMode::cmd_drive);
    EXPECT_FALSE(parameters.plant_model);
  }
}

TEST(NodeParameters, WhatDoesNotFitIsRefusedByName) {
  const std::vector<std::string> right{"front_right_wheel"};
  expectRefused("tuned", "controller.kappa_a", 60.0, "kappa_a = 60 is too large: stable below");
  // A robot without an identified model is taken for slower than assumed.
  expectRefused("improved", "controller.kappa_a", 22.0, "kappa_a = 22 is too large: stable below", "jackal_model");
  expectRefused("tuned", "plant_model.dead_time", 1.0, "closed loop diverges");
  expectRefused("tuned", "plant_model.lag", -0.1, "plant_model.lag = -0.1");
  expectRefused("predictive", "controller.kappa_a", 8.0, "both given");
  expectRefused("predictive", "predictive.belief_rate", 75.0, "predictive.belief_rate = 75");
  for (const char* key : {"predictive.gyro_variance", "faults.gyro_variance"}) {
    expectRefused("predictive", key, 1e-4, std::string(key) + " = 0.0001: unknown key");
  }
  for (const char* key : {"robot.base_frame", "odometry.frame"}) {
    expectRefused("improved", key, std::string("//"), std::string(key) + " = '//': must be the name of a frame");
  }
  expectRefused("improved", "output", std::string("serial"), "cmd_drive, twist, gazebo");
  expectRefused("improved", "slip.file", std::string("slip.yaml"), "must be an absolute path");
  expectRefused("improved", "robot.left_wheel_joints", right, "");
  EXPECT_NE(refusal(shipped("predictive"), jackalUrdf()).find("plant_model.*: missing"), std::string::npos);
  ParameterMap none;
  addYamlFile(kSource + "/config/jackal.yaml", none);
  EXPECT_NE(refusal(none, jackalUrdf()).find("controller.* or predictive.*: missing"), std::string::npos);
}

TEST(NodeParameters, SaysWhichRobotIsAssumedAndThatIdentifyIsDue) {
  EXPECT_NE(describeRobot(readNodeParameters(shipped("improved"), jackalUrdf)).find("No plant model"),
            std::string::npos);
  const auto described = [](const char* file) {
    ParameterMap map = shipped("predictive");
    addYamlFile(kSource + "/config/" + file, map);
    return describeRobot(readNodeParameters(map, jackalUrdf));
  };
  for (const auto& [file, robot] : {std::pair{"plant_model.yaml", "simulated Jackal"},
                                    {"plant_model_box.yaml", "simulated Jackal"},
                                    {"gazebo_model.yaml", "stock Jackal in Gazebo"}}) {
    EXPECT_NE(described(file).find(robot), std::string::npos) << described(file);
    EXPECT_EQ(described(file).find("identify"), std::string::npos) << described(file);
  }
  const std::string assumed = described("jackal_model.yaml");
  for (const char* word : {"Clearpath Jackal", "assumed dead time 0.08 s", "1.65 m/s^2", "Run identify.launch"}) {
    EXPECT_NE(assumed.find(word), std::string::npos) << assumed;
  }
  EXPECT_EQ(assumed.find('\n'), std::string::npos);
}

TEST(NodeParameters, OneVarianceOfASensorIsForAllThatWeighByIt) {
  ParameterMap map = shipped("predictive");
  addYamlFile(kSource + "/config/plant_model.yaml", map);
  map.set("sensors.gyro_variance", 1e-4);
  const NodeParameters parameters = readNodeParameters(map, jackalUrdf);
  EXPECT_EQ(std::get<PredictiveParameters>(parameters.controller).gyro_variance, 1e-4);
  EXPECT_EQ(parameters.faults->gyro_variance, 1e-4);
}

/// The bounds of a radius and a track hold wherever they come from.
TEST(NodeParameters, AUrdfInOtherUnitsIsRefused) {
  ParameterMap map = shipped("predictive");
  addYamlFile(kSource + "/config/plant_model.yaml", map);
  const auto with = [](const std::string& from, const std::string& to) {
    return std::regex_replace(jackalUrdf(), std::regex(from), to);
  };
  const std::string radius = "radius=\"0\\.098\"";
  ASSERT_NE(jackalUrdf(), with(radius, ""));
  EXPECT_EQ(refusal(map, with(radius, "radius=\"98\"")), "URDF: robot.wheel_radius = 98: must be in [0.01, 1] m");
  EXPECT_EQ(refusal(map, with(radius, "radius=\"1e-9\"")).rfind("URDF: robot.wheel_radius = 1e-09", 0), 0u);
}

TEST(NodeParameters, TakesGeometryFromTheUrdfUnlessTheYamlGivesIt) {
  ParameterMap map;
  addYamlFile(kSource + "/config/standard.yaml", map);
  NodeParameters parameters = readNodeParameters(map, jackalUrdf);
  EXPECT_NEAR(parameters.geometry.effective_track, 1.5 * 0.37559, 1e-9);
  EXPECT_NEAR(parameters.geometry.wheel_radius, 0.098, 1e-9);

  map.set("robot.track_multiplier", 1.2);
  EXPECT_NEAR(readNodeParameters(map, jackalUrdf).geometry.effective_track, 1.2 * 0.37559, 1e-9);

  map.set("robot.wheel_radius", 0.1);
  map.set("robot.effective_track", 0.6);
  parameters = readNodeParameters(map, []() -> std::string { throw std::logic_error("the URDF was read"); });
  EXPECT_EQ(parameters.geometry.wheel_radius, 0.1);
  EXPECT_EQ(parameters.geometry.effective_track, 0.6);
}

TEST(NodeParameters, AUrdfThatIsMissingOrWithoutWheelsIsRefused) {
  EXPECT_NE(refusal(shipped("standard"), "").find("robot.wheel_radius"), std::string::npos);
  EXPECT_NE(refusal(shipped("standard"), "").find("robot_description"), std::string::npos);
  const std::string cart = "<robot name='cart'><link name='base_link'/></robot>";
  EXPECT_NE(refusal(shipped("standard"), cart).find("front_left_wheel"), std::string::npos);
  EXPECT_FALSE(refusal(shipped("standard"), "not a robot").empty());
}

/// Expects that each bound of a gain shown at run time is the last value that is accepted towards `beyond`, and that
/// the server does not clamp to one before it asks.
template <class Config, class Parameters>
void expectBounds(Parameters parameters, double Bounds::*side, double beyond) {
  const Config generated = beyond < 0.0 ? Config::__getMin__() : Config::__getMax__();
  for (const auto& [name, bound] : settingsOf(generated)) {
    if (std::holds_alternative<double>(bound)) {
      EXPECT_EQ(std::get<double>(bound), beyond) << name;
    }
  }
  for (const auto& [name, bound] : settingsOf(rangeOf(parameters, side, generated))) {
    if (!std::holds_alternative<double>(bound)) continue;
    ParameterMap map;
    for (const Field& field : fieldsOf(parameters)) map.set("gains." + field.name, field.value);
    map.set("gains." + name, bound);
    EXPECT_NO_THROW(readParameters<Parameters>(map, "gains")) << name;
    map.set("gains." + name, std::nextafter(std::get<double>(bound), beyond));
    EXPECT_THROW(readParameters<Parameters>(map, "gains"), ParameterError) << name;
  }
}

TEST(GainServer, ShowsTheRangesOfTheParametersAndDoesNotClamp) {
  expectBounds<ControllerGainsConfig>(ControllerParameters{}, &Bounds::low, -HUGE_VAL);
  expectBounds<ControllerGainsConfig>(ControllerParameters{}, &Bounds::high, HUGE_VAL);
  expectBounds<PredictiveGainsConfig>(PredictiveParameters{}, &Bounds::low, -HUGE_VAL);
  expectBounds<PredictiveGainsConfig>(PredictiveParameters{}, &Bounds::high, HUGE_VAL);
  expectBounds<SensorNoiseConfig>(SensorNoise{}, &Bounds::low, -HUGE_VAL);
  expectBounds<SensorNoiseConfig>(SensorNoise{}, &Bounds::high, HUGE_VAL);
}

TEST(GainServer, OffersEveryPredictiveParameterButTheRates) {
  std::set<std::string> offered{"belief_rate", "action_rate"}, known;
  for (const auto& [name, value] : settingsOf(PredictiveGainsConfig::__getDefault__())) offered.insert(name);
  for (const Field& field : fieldsOf(PredictiveParameters{})) known.insert(field.name);
  EXPECT_EQ(offered, known);
}

/// Expects that the server starts from what a parameter struct starts from; returns how many settings it has.
template <class Config, class Parameters>
int expectDefaults() {
  int settings = 0;
  const NamedValues offered = settingsOf(Config::__getDefault__());
  for (const Field& field : fieldsOf(Parameters{})) {
    if (offered.count(field.name) == 0) continue;
    EXPECT_EQ(offered.at(field.name), field.value) << field.name;
    ++settings;
  }
  return settings;
}

TEST(GainServer, StartsFromTheDefaultsOfTheParameters) {
  EXPECT_EQ((expectDefaults<ControllerGainsConfig, ControllerParameters>()), 3);
  EXPECT_GT((expectDefaults<PredictiveGainsConfig, PredictiveParameters>()), 10);
  EXPECT_EQ((expectDefaults<SensorNoiseConfig, SensorNoise>()), 3);
}

/// Adds the fields of a parameter struct to a table by key.
template <class Parameters>
void add(const std::string& prefix, std::map<std::string, ParameterValue>& defaults) {
  for (const Field& field : fieldsOf(Parameters{}))
    defaults[(prefix.empty() ? "" : prefix + ".") + field.name] = field.value;
}

/// What every key of the shipped configuration has if no file gives it.
std::map<std::string, ParameterValue> defaultsOfTheStructs() {
  std::map<std::string, ParameterValue> defaults;
  add<ControllerParameters>("controller", defaults);
  add<PredictiveParameters>("predictive", defaults);
  add<DifferentialDriveParameters>("diff_drive", defaults);
  add<GeometryParameters>("robot", defaults);
  add<RobotNames>("robot", defaults);
  add<SensorNoise>("sensors", defaults);
  add<LimitParameters>("limits", defaults);
  add<DeadlineParameters>("deadlines", defaults);
  add<LossPolicyParameters>("on_loss", defaults);
  add<OdometryParameters>("odometry", defaults);
  add<BrakeParameters>("brake", defaults);
  add<PlausibilityParameters>("plausibility", defaults);
  add<FaultParameters>("faults", defaults);
  add<PlantModel>("plant_model", defaults);
  add<sim::PlantParameters>("plant", defaults);
  add<NodeOptions>("", defaults);
  const NodeParameters node;
  defaults["restart_after_stop"] =
      std::string(kRestartPolicyNames[static_cast<std::size_t>(node.gate.restart_after_stop)]);
  return defaults;
}

/// A whole number and a real one are the same in YAML.
ParameterValue asReal(const ParameterValue& value) {
  const auto* whole = std::get_if<std::int64_t>(&value);
  return whole == nullptr ? value : static_cast<double>(*whole);
}

TEST(Defaults, AreThoseOfTheShippedFiles) {
  ParameterMap map;
  for (const char* file : {"diff_drive", "advanced", "jackal", "standard", "predictive", "jackal_model", "plant"}) {
    addYamlFile(kSource + "/config/" + file + ".yaml", map);
  }
  // Which mean something else where they are missing: a robot without a name, one that was identified, and geometry
  // that the URDF tells. The baseline has a deadline of its own.
  const std::set<std::string> apart{"plant_model.robot", "plant_model.identified", "robot.wheel_radius"};
  int compared = 0;
  for (const auto& [key, value] : defaultsOfTheStructs()) {
    if (apart.count(key) > 0) continue;
    ASSERT_TRUE(map.has(key)) << key << " stands in no shipped file";
    EXPECT_EQ(describe(asReal(*map.take(key))), describe(asReal(value))) << key;
    ++compared;
  }
  EXPECT_GT(compared, 100);
  for (const std::string& key : apart) map.declare(key);
  EXPECT_NO_THROW(map.refuseUnknown());
}

}  // namespace
}  // namespace jackal_aic
