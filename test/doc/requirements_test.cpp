// Requirements are tied to tests and fault scenarios that exist.

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>

namespace jackal_aic {
namespace {

namespace fs = std::filesystem;

const fs::path kRoot = JACKAL_AIC_SOURCE_DIR;

/// Adds Class.test_name of every test of a Python source.
void addPythonTests(const std::string& source, std::set<std::string>& names) {
  const std::regex declaration(R"((?:^|\n)class (\w+)|\n    def (test_\w+))");
  std::string name;
  for (std::sregex_iterator found(source.begin(), source.end(), declaration), end; found != end; ++found) {
    if ((*found)[1].matched) name = (*found)[1];
    if ((*found)[2].matched) names.insert(name + "." + (*found)[2].str());
  }
}

/// Suite.Name of every test whose source lies under test/.
std::set<std::string> testNames() {
  const std::regex declaration(R"(TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\s*\))");
  std::set<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / "test")) {
    const bool python = entry.path().extension() == ".py";
    if (!python && entry.path().extension() != ".cpp") continue;
    std::ostringstream text;
    text << std::ifstream(entry.path()).rdbuf();
    const std::string source = text.str();
    if (python) addPythonTests(source, names);
    for (std::sregex_iterator found(source.begin(), source.end(), declaration), end; found != end; ++found) {
      names.insert((*found)[1].str() + "." + (*found)[2].str());
    }
  }
  return names;
}

TEST(Requirements, EachHasTestsAndNamesOnlyWhatThereIs) {
  const YAML::Node requirements = YAML::LoadFile(kRoot / "doc/reference/requirements.yaml");
  const YAML::Node scenarios = YAML::LoadFile(kRoot / "sim/faults/scenarios.yaml")["scenarios"];
  const std::set<std::string> tests = testNames();
  ASSERT_GE(tests.size(), 400u);
  ASSERT_GE(requirements.size(), 40u);
  std::set<std::string> ids;
  for (const YAML::Node& requirement : requirements) {
    const auto id = requirement["id"].as<std::string>();
    SCOPED_TRACE(id);
    EXPECT_TRUE(ids.insert(id).second) << "twice";
    EXPECT_FALSE(requirement["text"].as<std::string>().empty());
    EXPECT_FALSE(requirement["limit"].as<std::string>().empty());
    EXPECT_GE(requirement["tests"].size(), 1u);
    for (const YAML::Node& test : requirement["tests"]) {
      EXPECT_EQ(tests.count(test.as<std::string>()), 1u) << "no test " << test;
    }
    for (const YAML::Node& scenario : requirement["scenarios"]) {
      EXPECT_TRUE(scenarios[scenario.as<std::string>()]) << "no scenario " << scenario;
    }
    for (const auto& key : requirement) {
      const auto name = key.first.as<std::string>();
      EXPECT_TRUE(name == "id" || name == "text" || name == "limit" || name == "tests" || name == "scenarios") << name;
    }
  }
}

}  // namespace
}  // namespace jackal_aic
