// Parameters of the node, from files, the parameter server, dynamic_reconfigure and the learned file; no master.

#include "parameters/node_parameters.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <regex>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "../command.hpp"
#include "../complaint.hpp"
#include "../repository.hpp"
#include "../temporary_directory.hpp"
#include "jackal_aic/config/text.hpp"
#include "jackal_aic/config/yaml.hpp"
#include "parameters/learned_file.hpp"
#include "parameters/live_parameters.hpp"
#include "parameters/ros_parameters.hpp"

namespace jackal_aic {
namespace {

std::string refusal(const ParameterMap& map, const std::string& urdf = jackalUrdf()) {
  const std::string said = complaint([&] { readNodeParameters(map, [&] { return urdf; }); });
  EXPECT_NE(said, "") << "accepted";
  return said;
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

TEST(NodeParameters, TakesGeometryFromTheUrdfUnlessTheYamlGivesIt) {
  ParameterMap map = shipped({"standard"});
  NodeParameters parameters = readNodeParameters(map, jackalUrdf);
  EXPECT_EQ(parameters.output, OutputMode::cmd_drive);
  EXPECT_FALSE(parameters.plant_model);
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
      if (std::holds_alternative<double>(bound)) {
        EXPECT_EQ(std::get<double>(bound), beyond) << name;
      }
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

/// A YAML file as rosparam reads it and the parameter server hands it on.
ParameterMap fileThroughRosparam(const std::string& path) {
  const std::string program =
      "import sys, xmlrpc.client, yaml; print(xmlrpc.client.dumps((yaml.safe_load(open(sys.argv[1])),)))";
  const std::string xml = runCommand("/usr/bin/python3 -c '" + program + "' " + path).text;
  int offset = static_cast<int>(xml.find("<value>"));
  return parametersIn(XmlRpc::XmlRpcValue(xml, &offset));
}

ParameterMap throughRosparam(const std::string& yaml) {
  const TemporaryDirectory directory;
  return fileThroughRosparam(directory.write("parameters.yaml", yaml));
}

TEST(EveryReader, TakesATextForTheSame) {
  for (const std::string text :
       {"0.5",  "3", "-1",        "1e8", "1.0e8", "1.0e+08",  "-2E-3",    "true",   "Yes",        "off",
        "word", "e", "two words", "'2'", "'on'",  "[1, 2.5]", "[1e8, 2]", "[a, b]", "['1', '2']", "['a,b', c]"}) {
    const std::string line = "section: {key: " + text + "}";
    ParameterMap file, set, server = throughRosparam(line);
    addYamlText(line, "file", file);
    setFromText("section.key", text, set);
    const ParameterValue* expected = file.take("section.key");
    ASSERT_NE(expected, nullptr);
    for (ParameterMap* other : {&set, &server}) {
      const ParameterValue* value = other->take("section.key");
      ASSERT_NE(value, nullptr) << text;
      EXPECT_EQ(*value, *expected) << text << ": " << describe(*value) << " and " << describe(*expected);
    }
  }
}

TEST(RosParameters, EveryShippedFileIsTheSameForRosparam) {
  int values = 0;
  for (const auto& entry : std::filesystem::directory_iterator(std::string(JACKAL_AIC_SOURCE_DIR) + "/config")) {
    if (entry.path().filename() == "robot_localization.yaml") continue;  // of another package's node
    ParameterMap file, server = fileThroughRosparam(entry.path().string());
    addYamlFile(entry.path().string(), file);
    ASSERT_EQ(server.keys(), file.keys()) << entry.path();
    for (const std::string& key : file.keys()) {
      EXPECT_EQ(*server.take(key), *file.take(key)) << entry.path() << ": " << key;
      ++values;
    }
  }
  EXPECT_GT(values, 150);
}

TEST(RosParameters, RefusesAnEmptyMapAsTheFileDoes) {
  for (const char* yaml : {"plant_model: {gain: {}}", "controller: {}"}) {
    ParameterMap file;
    EXPECT_THROW(addYamlText(yaml, "file", file), ParameterError) << yaml;
    EXPECT_THROW(throughRosparam(yaml), ParameterError) << yaml;
  }
  EXPECT_TRUE(throughRosparam("{}").keys().empty()) << "a namespace without parameters";
}

TEST(Frames, HaveThePrefixOfTheirRobot) {
  EXPECT_EQ(prefixedFrame("", "odom"), "odom");
  EXPECT_EQ(prefixedFrame("robot1", "odom"), "robot1/odom");
  EXPECT_EQ(prefixedFrame("/robot1/", "odom"), "robot1/odom");
  EXPECT_EQ(prefixedFrame("fleet/robot1", "imu_link"), "fleet/robot1/imu_link");
  EXPECT_EQ(prefixedFrame("robot1", "/map"), "map");
  EXPECT_EQ(prefixedFrame("//", "odom"), "odom");
}

const SlipState kConfigured{0.5621, 1.0};
const LearnedModel kThen{kConfigured, DriveTrainTiming{0.08, 0.006}};

class LearnedFileTest : public testing::Test {
 protected:
  /// What comes back of what is written.
  LearnedModel again(const LearnedModel& learned, const LearnedModel& configured = kThen) const {
    writeLearnedFile(path_, learned, configured);
    return readLearnedFile(path_, configured).value();
  }

  std::string refusal() const {
    return complaint([this] { readLearnedFile(path_, kThen); }, 400 + path_.size());
  }

  TemporaryDirectory directory_;
  std::string path_ = directory_.path("slip.yaml");
};

TEST_F(LearnedFileTest, GivesBackWhatWasWritten) {
  EXPECT_FALSE(readLearnedFile(path_, kThen)) << "there is no file";
  const LearnedModel learned = again({{0.7123, 0.93}, DriveTrainTiming{0.123, 0.045}});
  EXPECT_EQ(std::pair(learned.slip.effective_track, learned.slip.slip_factor), std::pair(0.7123, 0.93));
  EXPECT_EQ(std::pair(learned.timing.value().dead_time, learned.timing->lag), std::pair(0.123, 0.045));
  EXPECT_FALSE(again({{0.7123, 0.93}}).timing) << "it was not learned";
  const LearnedModel slow{kConfigured, DriveTrainTiming{0.6, 0.7}};
  EXPECT_FALSE(again(slow, slow).timing) << "slower than anything learned";
  directory_.write("slip.yaml", "slip: {slip_factor: 1.0, effective_track: 0.5621}\n");
  EXPECT_FALSE(readLearnedFile(path_, kThen)->timing) << "a file from before they were learned";
}

TEST_F(LearnedFileTest, GivesBackHowTheTurnDependsOnTheMotion) {
  Turn belief(kConfigured, 0.098);
  for (const double mean : {2.0, 8.0}) {
    const WheelVector wheels(mean - 2.0, mean + 2.0);
    belief.learn({0.6 + 0.01 * mean, 0.0, wheels, wheels, 1e-4}, 0.5, 0.02);
  }
  const auto turn = again({belief.state()}).slip.turn.value();
  EXPECT_EQ(turn.mean, belief.state().turn->mean);
  EXPECT_EQ(turn.covariance, belief.state().turn->covariance);
}

TEST_F(LearnedFileTest, RefusesWhatWasLearnedWithAnotherConfiguration) {
  const LearnedModel now{kConfigured, DriveTrainTiming{0.2, 0.006}};
  writeLearnedFile(path_, {{0.7123, 0.93}, DriveTrainTiming{0.123, 0.045}}, kThen);
  EXPECT_EQ(complaint([&] { readLearnedFile(path_, now); }),
            "slip.file = '" + path_ +
                "': learned with dead time 0.08 s, lag 0.006 s, configured with dead time 0.2 s, lag 0.006 s now");
  EXPECT_THROW(readLearnedFile(path_, {{5.0, 1.0}, kThen.timing}), ParameterError);
}

TEST_F(LearnedFileTest, PutsAFileAsideThatCannotBeUsed) {
  directory_.write("slip.yaml", "slip: {told_track: 0.5}");
  directory_.write("slip.yaml.old", "an earlier one");
  EXPECT_TRUE(putAside(path_));
  EXPECT_FALSE(std::filesystem::exists(path_));
  EXPECT_EQ(readText(path_ + ".old"), "slip: {told_track: 0.5}");
  EXPECT_FALSE(putAside(directory_.path(""))) << "a directory";
}

TEST_F(LearnedFileTest, RefusesWhatIsOutOfRangeMissingUnknownOrNoNumber) {
  const std::string slip = "slip: {slip_factor: 1.0, effective_track: 0.5621";
  const std::pair<std::string, std::string> rows[] = {
      {"slip: {effective_track: 3.0, slip_factor: 1.0}", "slip.effective_track = 3"},
      {"slip: {effective_track: 0.5, slip_factor: 2.5}", "slip.slip_factor = 2.5"},
      {"slip: {effective_track: .nan, slip_factor: 1.0}", "slip.effective_track"},
      {"slip: {effective_track: 0.5}", "slip.slip_factor"},
      {"slip: {effective_track: 0.5, slip_factor: 1.0, beta: 2.0}", "slip.beta"},
      {"slip: {effective_track: wide, slip_factor: 1.0}", "wide"},
      {"slip: [0.5", path_},
      {"", ""},
      {slip + ", turn_coefficients: [1.8, 0, 0, 0]}", "4 and 0 numbers: must be 4 and 10"},
      {slip + ", turn_coefficients: [1.8, 0, 0, 0], turn_covariance: [1, 0, 1, 0, 0, -1, 0, 0, 0, 1]}",
       "positive definite"},
      {slip + "}\ndrive_train: {dead_time: 0.1}", "drive_train.lag"},
      {slip + "}\ndrive_train: {dead_time: 2.0, lag: 0.01}", "drive_train.dead_time = 2: must be in [0, 0.4] s"}};
  for (const auto& [text, said] : rows) {
    directory_.write("slip.yaml", text);
    expectSays(refusal(), {said});
  }
  directory_.write("slip.yaml", rows[0].first);
  expectSays(refusal(), {path_});
  path_ += "\n" + std::string(300, 'x');  // a path that cannot be
  EXPECT_EQ(refusal().rfind("slip.file = '/", 0), 0u) << refusal();
}

TEST_F(LearnedFileTest, IsWrittenWholeOrNotAtAll) {
  const auto refusalOfWriting = [](const std::string& path) {
    return complaint([&] { writeLearnedFile(path, {{0.7, 1.0}}, kThen); });
  };
  EXPECT_EQ(refusalOfWriting(path_), "");
  directory_.write("slip.yaml.new", "half a fi");  // a writer that was killed
  EXPECT_NEAR(again({{0.6, 1.0}}).slip.effective_track, 0.6, 1e-9);
  EXPECT_FALSE(std::filesystem::exists(path_ + ".new"));
  std::filesystem::create_symlink("/dev/full", path_ + ".new");
  expectSays(refusalOfWriting(path_), {"No space left on device"});
  EXPECT_NEAR(readLearnedFile(path_, kThen)->slip.effective_track, 0.6, 1e-9);
  expectSays(refusalOfWriting("/nowhere/slip.yaml"), {"/nowhere/slip.yaml", "No such file or directory"});
}

}  // namespace
}  // namespace jackal_aic
