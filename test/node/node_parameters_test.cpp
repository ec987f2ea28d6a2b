#include "parameters/node_parameters.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <regex>
#include <set>
#include <tuple>

#include "../complaint.hpp"
#include "../repository.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"
#include "parameters/live_parameters.hpp"

namespace jackal_aic {
namespace {

std::string jackalUrdf() { return textOf("sim/urdf/jackal.urdf"); }

ParameterMap shipped(const std::vector<std::string>& files) {
  ParameterMap map;
  for (const std::string& file : files) addYamlFile((kRoot / "config" / (file + ".yaml")).string(), map);
  return map;
}

std::string refusal(const ParameterMap& map, const std::string& urdf = jackalUrdf()) {
  const std::string said = complaint([&] { readNodeParameters(map, [&] { return urdf; }); });
  EXPECT_NE(said, "") << "accepted";
  return said;
}

TEST(NodeParameters, ShippedFilesAreCompleteAndValid) {
  for (const char* preset : {"standard", "improved", "tuned"}) {
    const NodeParameters parameters = readNodeParameters(shipped({"jackal", preset}), jackalUrdf);
    EXPECT_DOUBLE_EQ(parameters.geometry.effective_track, 0.5621);
    EXPECT_DOUBLE_EQ(parameters.geometry.wheel_radius, 0.098) << "from the URDF";
    EXPECT_EQ(parameters.output, OutputMode::cmd_drive);
    EXPECT_FALSE(parameters.plant_model);
  }
}

TEST(NodeParameters, WhatDoesNotFitIsRefusedByName) {
  const struct {
    const char *preset, *key;
    ParameterValue value;
    std::string said;
    const char* model = "plant_model";
  } rows[] = {
      {"tuned", "controller.kappa_a", 60.0, "kappa_a = 60 is too large: stable below"},
      // A robot without an identified model is taken for slower than assumed.
      {"improved", "controller.kappa_a", 22.0, "kappa_a = 22 is too large: stable below", "jackal_model"},
      {"tuned", "plant_model.dead_time", 1.0, "closed loop diverges"},
      {"tuned", "plant_model.lag", -0.1, "plant_model.lag = -0.1"},
      {"predictive", "controller.kappa_a", 8.0, "both given"},
      {"predictive", "predictive.belief_rate", 75.0, "predictive.belief_rate = 75"},
      {"predictive", "predictive.gyro_variance", 1e-4, "predictive.gyro_variance = 0.0001: unknown key"},
      {"predictive", "faults.gyro_variance", 1e-4, "faults.gyro_variance = 0.0001: unknown key"},
      {"improved", "robot.base_frame", std::string("//"), "robot.base_frame = '//': must be the name of a frame"},
      {"improved", "odometry.frame", std::string("//"), "odometry.frame = '//': must be the name of a frame"},
      {"improved", "output", std::string("serial"), "cmd_drive, twist, gazebo"},
      {"improved", "slip.file", std::string("slip.yaml"), "must be an absolute path"},
      {"improved", "robot.left_wheel_joints", std::vector<std::string>{"front_right_wheel"}, ""}};
  for (const auto& row : rows) {
    ParameterMap map = shipped({"jackal", row.preset, row.model});
    map.set(row.key, row.value);
    expectSays(refusal(map), {row.said});
  }
  expectSays(refusal(shipped({"jackal", "predictive"})), {"plant_model.*: missing"});
  expectSays(refusal(shipped({"jackal"})), {"controller.* or predictive.*: missing"});
}

TEST(NodeParameters, SaysWhichRobotIsAssumedAndThatIdentifyIsDue) {
  const auto described = [](const std::vector<std::string>& files) {
    return describeRobot(readNodeParameters(shipped(files), jackalUrdf));
  };
  expectSays(described({"jackal", "improved"}), {"No plant model"});
  for (const auto& [file, robot] : {std::pair{"plant_model", "simulated Jackal"},
                                    {"plant_model_box", "simulated Jackal"},
                                    {"gazebo_model", "stock Jackal in Gazebo"}}) {
    expectSays(described({"jackal", "predictive", file}), {robot});
    expectSaysNot(described({"jackal", "predictive", file}), {"identify"});
  }
  const std::string assumed = described({"jackal", "predictive", "jackal_model"});
  expectSays(assumed, {"Clearpath Jackal", "assumed dead time 0.08 s", "1.65 m/s^2", "Run identify.launch"});
  expectSaysNot(assumed, {"\n"});
}

TEST(NodeParameters, OneVarianceOfASensorIsForAllThatWeighByIt) {
  ParameterMap map = shipped({"jackal", "predictive", "plant_model"});
  map.set("sensors.gyro_variance", 1e-4);
  const NodeParameters parameters = readNodeParameters(map, jackalUrdf);
  EXPECT_EQ(std::get<PredictiveParameters>(parameters.controller).gyro_variance, 1e-4);
  EXPECT_EQ(parameters.faults->gyro_variance, 1e-4);
}

TEST(NodeParameters, TakesGeometryFromTheUrdfUnlessTheYamlGivesIt) {
  ParameterMap map = shipped({"standard"});
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

/// The bounds of a radius and a track hold wherever they come from.
TEST(NodeParameters, AUrdfThatIsMissingOrWrongIsRefused) {
  const ParameterMap map = shipped({"jackal", "standard"});
  const auto withRadius = [](const std::string& radius) {
    const std::regex shipped("radius=\"0\\.098\"");
    EXPECT_TRUE(std::regex_search(jackalUrdf(), shipped));
    return std::regex_replace(jackalUrdf(), shipped, "radius=\"" + radius + "\"");
  };
  expectSays(refusal(map, ""), {"robot.wheel_radius", "robot_description"});
  expectSays(refusal(map, "<robot name='cart'><link name='base_link'/></robot>"), {"front_left_wheel"});
  expectSays(refusal(map, "not a robot"), {});
  EXPECT_EQ(refusal(map, withRadius("98")), "URDF: robot.wheel_radius = 98: must be in [0.01, 1] m");
  EXPECT_EQ(refusal(map, withRadius("1e-9")).rfind("URDF: robot.wheel_radius = 1e-09", 0), 0u);
}

/// Expects that each setting of a server of gains starts from the default of its parameter, that each bound it shows is
/// the last value that is accepted, and that it does not clamp to that before it asks. Returns the names.
template <class Config, class Parameters>
std::set<std::string> expectServed() {
  const NamedValues defaults = settingsOf(Config::__getDefault__());
  std::set<std::string> served;
  ParameterMap fields;
  for (const Field& field : fieldsOf(Parameters{})) {
    fields.set("gains." + field.name, field.value);
    if (defaults.count(field.name) == 0) continue;
    EXPECT_EQ(defaults.at(field.name), field.value) << field.name;
    served.insert(field.name);
  }
  EXPECT_EQ(served.size(), defaults.size());
  for (const auto& [side, generated, beyond] : {std::tuple(&Bounds::low, Config::__getMin__(), -HUGE_VAL),
                                                std::tuple(&Bounds::high, Config::__getMax__(), HUGE_VAL)}) {
    for (const auto& [name, bound] : settingsOf(generated)) {
      if (std::holds_alternative<double>(bound)) EXPECT_EQ(std::get<double>(bound), beyond) << name;
    }
    for (const auto& [name, bound] : settingsOf(rangeOf(Parameters{}, side, generated))) {
      if (!std::holds_alternative<double>(bound)) continue;
      ParameterMap map = fields;
      map.set("gains." + name, bound);
      EXPECT_NO_THROW(readParameters<Parameters>(map, "gains")) << name;
      map.set("gains." + name, std::nextafter(std::get<double>(bound), beyond));
      EXPECT_THROW(readParameters<Parameters>(map, "gains"), ParameterError) << name;
    }
  }
  return served;
}

TEST(GainServer, OffersDefaultsAndRangesOfEveryGainButTheRates) {
  EXPECT_EQ((expectServed<ControllerGainsConfig, ControllerParameters>().size()), 3u);
  EXPECT_EQ((expectServed<SensorNoiseConfig, SensorNoise>().size()), 3u);
  std::set<std::string> offered = expectServed<PredictiveGainsConfig, PredictiveParameters>(), known;
  offered.insert({"belief_rate", "action_rate"});
  for (const Field& field : fieldsOf(PredictiveParameters{})) known.insert(field.name);
  EXPECT_EQ(offered, known);
}

}  // namespace
}  // namespace jackal_aic
