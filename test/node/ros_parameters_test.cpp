// One text, three ways in: a YAML file, --set, and rosparam with its YAML 1.1 and XML-RPC. Each has to give the same.

#include "parameters/ros_parameters.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "../command.hpp"
#include "../complaint.hpp"
#include "../temporary_directory.hpp"
#include "jackal_aic/config/text.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"
#include "jackal_aic/config/yaml_text.hpp"

namespace jackal_aic {
namespace {

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

class EveryReader : public testing::TestWithParam<const char*> {};

TEST_P(EveryReader, TakesATextForTheSame) {
  const std::string text = GetParam(), line = "section: {key: " + text + "}";
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

INSTANTIATE_TEST_SUITE_P(Values, EveryReader,
                         testing::Values("0.5", "3", "-1", "1e8", "1.0e8", "1.0e+08", "-2E-3", "true", "Yes", "off",
                                         "word", "e", "two words", "'2'", "'on'", "[1, 2.5]", "[1e8, 2]", "[a, b]",
                                         "['1', '2']", "['a,b', c]"));

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

}  // namespace
}  // namespace jackal_aic
