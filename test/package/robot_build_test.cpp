// The package as a robot's computer builds it: -DJACKAL_AIC_SIMULATION=OFF, without what only the simulation needs.

#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>

#include "../command.hpp"
#include "../repository.hpp"

namespace jackal_aic {
namespace {

namespace fs = std::filesystem;

/// What is between two texts of a page.
std::string between(const std::string& page, const std::string& begin, const std::string& end) {
  const auto from = page.find(begin);
  if (from == std::string::npos) throw std::runtime_error("no " + begin);
  return page.substr(from + begin.size(), page.find(end, from + begin.size()) - from - begin.size());
}

TEST(RobotBuild, HasTheNodeThePluginAndTheToolsOfARobot) {
  if (*JACKAL_AIC_SANITIZER != '\0') GTEST_SKIP() << "the messages are those of an instrumented build";
  const std::string command =
      "sh " + (kRoot / "test/robot/check").string() + " " JACKAL_AIC_DEVEL " " JACKAL_AIC_BUILD "/robot";
  const auto [said, status] = runCommand(command);
  ASSERT_EQ(status, 0) << said;
  const std::set<std::string> programs = found(said, "program: (\\w+)\n");
  EXPECT_LE(programs.size(), 8u);
  EXPECT_EQ(programs, found(between(textOf("doc/reference/programs.md"), "programs: ", ". The"), "`(\\w+)`"));
  EXPECT_LE(found(said, "library: (\\S+)\n").size(), 4u);
  EXPECT_NE(said.find("library: libjackal_aic_ros_control.so\n"), std::string::npos);
}

/// As the rooms lie above each other: the simulation knows the core, the node and the tools, and none of them knows it.
TEST(RobotBuild, NoSourceIncludesAHeaderOfTheSimulation) {
  std::set<std::string> simulation;  // every ending of a path
  int headers = 0;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / "sim")) {
    if (entry.path().extension() != ".hpp") continue;
    fs::path ending = entry.path().filename();
    for (fs::path folder = entry.path().parent_path(); folder != kRoot; folder = folder.parent_path()) {
      simulation.insert(ending);
      ending = folder.filename() / ending;
    }
    ++headers;
  }
  EXPECT_GT(headers, 10);
  int sources = 0;
  for (const char* directory : {"include", "src"}) {
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / directory)) {
      if (entry.path().extension() != ".cpp" && entry.path().extension() != ".hpp") continue;
      for (const std::string& header : found(textOf(entry.path()), "#include \"(?:\\.\\./)*([^\"]+)\"")) {
        EXPECT_EQ(simulation.count(header), 0u) << entry.path() << ": " << header;
      }
      ++sources;
    }
  }
  EXPECT_GT(sources, 100);
}

/// package.xml lists for rosdep what a robot may leave uninstalled.
TEST(RobotBuild, TheGuideSkipsThePackagesOfTheSimulation) {
  const std::string simulation = between(textOf("package.xml"), "-DJACKAL_AIC_SIMULATION=OFF", "<export>");
  std::set<std::string> named = found(simulation, "depend>([^<]+)</");
  EXPECT_GT(named.size(), 5u);
  named.erase("roslaunch");  // which the node is started with
  EXPECT_EQ(found(between(textOf("doc/guides/on_your_jackal.md"), "--skip-keys=\"", "\""), "([\\w-]{2,})"), named);
}

}  // namespace
}  // namespace jackal_aic
