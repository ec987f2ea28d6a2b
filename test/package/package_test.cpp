// The package as others meet it: its manifest, its programs, and what a package downstream is built against.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "../command.hpp"
#include "../repository.hpp"

namespace jackal_aic {
namespace {

namespace fs = std::filesystem;

/// Everything that package.xml depends on.
std::set<std::string> dependencies() { return found(textOf(kRoot / "package.xml"), "<\\w*depend>([^<]+)</"); }

bool isRosPackage(const std::string& name) {
  for (const fs::path& share : {fs::path("/usr/share"), fs::path("/opt/ros/noetic/share"), kRoot / "sim"}) {
    if (fs::exists(share / name / "package.xml")) return true;
  }
  return false;
}

/// What a command prints, and that it ended well.
std::string output(const std::string& command) {
  const auto [text, status] = runCommand(command);
  EXPECT_EQ(status, 0) << command << "\n" << text;
  return text;
}

/// The packages that catkin finds for the build, and no others of ROS that nothing uses.
TEST(Manifest, NamesThePackagesThatTheBuildFinds) {
  const std::set<std::string> named = dependencies();
  const std::string build = textOf(kRoot / "CMakeLists.txt");
  const std::size_t begin = build.find("find_package(catkin REQUIRED COMPONENTS");
  std::set<std::string> used = found(build.substr(begin, build.find(')', begin) - begin), "([a-z_0-9]+)\\b(?!\\()");
  for (const char* word : {"find_package", "catkin"}) used.erase(word);
  EXPECT_GT(used.size(), 15u);
  for (const std::string& name : used) EXPECT_TRUE(named.count(name) > 0) << name;
  used.insert("message_runtime");  // of the generated messages
  for (const char* directory : {"src", "sim", "test", "launch", "CMakeLists.txt"}) {
    const auto read = [&](const fs::path& path) {
      used.merge(found(textOf(path), "(?:find_package\\(|pkg=\"|import |from |#include <)(\\w+)"));
      used.merge(found(textOf(path), "(?:rosrun|exec|run) (\\w+) "));
    };
    if (fs::is_regular_file(kRoot / directory)) {
      read(kRoot / directory);
      continue;
    }
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / directory)) {
      if (entry.is_regular_file() && entry.path().extension() != ".pyc") read(entry.path());
    }
  }
  for (const std::string& name : named) {
    if (isRosPackage(name)) EXPECT_TRUE(used.count(name) > 0) << name << " is used by nothing";
  }
}

TEST(Manifest, HasTheVersionOfTheChangelogAndTheCitation) {
  const std::string version = *found(textOf(kRoot / "package.xml"), "<version>([^<]+)</version>").begin();
  const std::string changelog = textOf(kRoot / "CHANGELOG.rst"), citation = textOf(kRoot / "CITATION.cff");
  std::smatch newest, cited;
  ASSERT_TRUE(std::regex_search(changelog, newest, std::regex(R"((\d+\.\d+\.\d+) \((\d{4}-\d\d-\d\d)\)\n-{18}\n)")));
  EXPECT_EQ(newest[1], version);
  ASSERT_TRUE(std::regex_search(citation, cited, std::regex(R"(\nversion: (\S+)\ndate-released: (\S+)\n)")));
  EXPECT_EQ(cited[1], version);
  EXPECT_EQ(cited[2], newest[2]);
}

TEST(Programs, AnswerHelpWithoutAMaster) {
  std::set<std::string> programs;
  for (const char* directory : {"src", "sim"}) {
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / directory)) {
      if (entry.path().filename() == "CMakeLists.txt") {
        programs.merge(found(textOf(entry.path()), "add_executable\\((\\w+)"));
      }
    }
  }
  // Nodes are started by launch files, which know their arguments.
  for (const char* node : {"controller_node", "plant_node"}) {
    EXPECT_EQ(programs.erase(node), 1u) << node;
  }
  EXPECT_EQ(programs, (std::set<std::string>{"analyze", "identify", "replay"}));
  programs.insert({"experiments", "tune", "tick_benchmark"});  // in Python, and of the tests
  for (const std::string& program : programs) {
    std::string path = JACKAL_AIC_DEVEL "/lib/jackal_aic/" + program;
    if (!fs::exists(path)) path = JACKAL_AIC_DEVEL "/share/jackal_aic/internal/" + program;
    const std::string help = output("ROS_MASTER_URI=http://127.0.0.1:1 timeout 20 " + path + " --help");
    EXPECT_NE(help.find(program), std::string::npos) << help;
    EXPECT_TRUE(found(help, "(=\\d\\.\\d*0000\\d)").empty()) << "a number as no person writes it\n" << help;
  }
  const auto scripts = found(textOf(kRoot / "src/tools/CMakeLists.txt"), "(view/\\w+)\\s");
  EXPECT_GT(scripts.size(), 2u);
  for (const std::string& script : scripts) {
    const std::string path = (kRoot / "src/tools" / script).string();
    const std::string help = output("ROS_MASTER_URI=http://127.0.0.1:1 timeout 20 " + path + " --help");
    EXPECT_NE(help.find(fs::path(script).filename().string()), std::string::npos) << help;
  }
  output((kRoot / "launch/show_rviz").string() + " --help");
}

/// rospy and numpy are of the distribution's Python: another one (pyenv, conda) may stand first on the PATH.
TEST(Programs, RunByThePythonOfTheDistribution) {
  int programs = 0;
  for (const char* directory : {"cfg", "launch", "scripts", "sim", "src", "test"}) {
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / directory)) {
      if (!entry.is_regular_file() || entry.path().extension() == ".pyc") continue;
      const std::string text = textOf(entry.path()), head = text.substr(0, text.find('\n'));
      if (head.rfind("#!", 0) != 0 || head.find("python") == std::string::npos) continue;
      EXPECT_EQ(head, "#!/usr/bin/python3") << entry.path();
      ++programs;
    }
  }
  EXPECT_GT(programs, 20);
}

/// Names of the first column of the tables under a heading of programs.md.
std::set<std::string> listed(const std::string& heading) {
  const std::string page = textOf(kRoot / "doc/reference/programs.md");
  const auto begin = page.find("\n## " + heading);
  if (begin == std::string::npos) throw std::runtime_error("programs.md: no " + heading);
  return found(page.substr(begin, page.find("\n## ", begin + 1) - begin), "\n\\| `([\\w/]+)` \\|");
}

std::set<std::string> namesIn(const fs::path& directory) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(directory)) {
    if (entry.is_regular_file()) names.insert(entry.path().filename());
  }
  return names;
}

/// What `rosrun jackal_aic <TAB>` shows in a space; nothing without rosbash, which leaves out paths with a dot.
std::set<std::string> completed(const std::string& space) {
  std::string completion;
  for (const char* file : {"/usr/share/bash-completion/completions/rosbash", "/opt/ros/noetic/share/rosbash/rosbash"}) {
    if (fs::exists(file)) completion = file;
  }
  if (completion.empty() || space.find("/.") != std::string::npos) return {};
  return found(output("bash -c '. " + space + "/setup.bash; . " + completion +
                      "; COMP_WORDS=(rosrun jackal_aic \"\"); COMP_CWORD=2; _roscomplete_exe; printf \"%s\\n\" "
                      "\"${COMPREPLY[@]}\"'"),
               "([^\\s]+)");
}

TEST(Programs, OnlyThoseForUsersAreCompletedAndEachHasALineInTheReference) {
  const std::set<std::string> names = completed(JACKAL_AIC_DEVEL);
  if (names.empty()) GTEST_SKIP() << "no completion by rosbash";
  EXPECT_EQ(names, listed("For users"));
  EXPECT_LE(names.size(), 15u);
}

TEST(Programs, ThatNoUserTypesHaveALineInTheReference) {
  std::set<std::string> names = listed("Started by launch files");
  names.merge(listed("Examples and measurements"));
  EXPECT_EQ(namesIn(JACKAL_AIC_DEVEL "/share/jackal_aic/internal"), names);
  std::set<std::string> scripts;
  for (const std::string& name : namesIn(kRoot / "scripts")) scripts.insert("scripts/" + name);
  EXPECT_EQ(scripts, listed("Scripts of the checkout"));
}

/// What a user typed or a file is called is text of anybody: it ends up in the one line of an error, and not on
/// another.
TEST(Programs, TellWhatIsWrongInOneLine) {
  for (const char* program : {"analyze", "experiments step --plant ground --step 1 --controller", "identify", "replay",
                              "tune --out nowhere/gains.yaml --plant"}) {
    const bool python = std::string(program).find("experiments") == 0 || std::string(program).find("tune") == 0;
    const std::string directory = python ? (kRoot / "sim/lab/").string() : JACKAL_AIC_DEVEL "/lib/jackal_aic/";
    const std::string text =
        output("! timeout 20 " + directory + std::string(program) + " \"$(printf 'no\\n\\033[31msuch')\"");
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << text;
    EXPECT_EQ(text.find('\033'), std::string::npos) << text;
    EXPECT_NE(text.find("such"), std::string::npos) << text;
  }
}

/// Installs a package with an apt of the test's own, which prints its arguments, on a terminal or not; what is said.
std::string installed(const std::string& simulated, bool terminal, bool yes) {
  const std::string script = testing::TempDir() + "install" + std::to_string(getpid());
  const std::string library = (kRoot / "scripts/lib/").string();
  std::ofstream(script) << "set -eu; sudo() { \"$@\"; }\n"
                        << "apt-get() { [[ $1 == --simulate ]] && echo '" << simulated << "' || echo apt \"$@\"; }\n"
                        << "assume_yes=" << (yes ? "true" : "false") << "; missing=()\n"
                        << ". " << library << "progress.sh; . " << library << "packages.sh\n"
                        << "install_packages no-such-package 2>&1\n";
  const std::string command = "bash " + script;
  const std::string said =
      output((terminal ? "script -qec '" + command + "' /dev/null" : command) + " < /dev/null || true");
  fs::remove(script);
  return said;
}

TEST(Scripts, LetAptAskOnATerminalAndUpgradeOrRemoveNothing) {
  for (const auto& [terminal, yes, asks] :
       {std::tuple{true, false, true}, {true, true, false}, {false, false, false}}) {
    const std::string said = installed("Inst no-such-package (2 Debian)", terminal, yes);
    EXPECT_NE(said.find("nothing is upgraded or removed): no-such-package"), std::string::npos) << said;
    EXPECT_NE(said.find("install --no-install-recommends --no-upgrade --no-remove no-such-package"), std::string::npos)
        << said;
    EXPECT_EQ(said.find(" -y") == std::string::npos, asks) << said;
  }
  // apt upgrades what a new package needs in a newer version, even with --no-upgrade.
  const std::string refused = installed("Inst libc6 [1] (2 Debian)", false, true);
  EXPECT_NE(refused.find("Run: apt-get install --only-upgrade libc6\n"), std::string::npos) << refused;
  EXPECT_EQ(refused.find("apt -q -o DPkg::Lock::Timeout=300 install"), std::string::npos) << refused;
}

TEST(Launch, ARobotFileMaySayMoreThanTheShippedOne) {
  const std::string robot = testing::TempDir() + "robot" + std::to_string(getpid()) + ".yaml";
  std::ofstream(robot) << "robot: {effective_track: 0.6}\ndeadlines: {imu: 0.1}\noutput: twist\n";
  for (const char* launch : {"controller", "jackal", "gazebo", "simulation"}) {
    const std::string dumped =
        output(std::string("roslaunch --dump-params jackal_aic ") + launch + ".launch robot:=" + robot);
    // The simulated robot has no other topic.
    const std::string output_mode = launch == std::string("simulation") ? "output: cmd_drive" : "output: twist";
    for (const std::string parameter :
         {"robot/effective_track: 0.6", "deadlines/imu: 0.1", "deadlines/wheels: 0.2", output_mode.c_str()}) {
      EXPECT_NE(dumped.find("/jackal_aic/" + parameter), std::string::npos) << launch << "\n" << dumped;
    }
  }
  std::ofstream(robot) << "deadlines: {set_point: 0.4}\n";
  const std::string after = "roslaunch --dump-params jackal_aic controller.launch preset:=diff_drive robot:=" + robot;
  EXPECT_EQ(found(output(after), "/jackal_aic/deadlines/set_point: ([\\d.]+)"), std::set<std::string>{"0.4"})
      << "it comes after the preset";
  fs::remove(robot);
}

/// Where the robot stands is one setting for the plant and its controller; Gazebo has a
/// model of its own robot; only the thesis' presets have a printed mode.
TEST(Launch, ArgumentsSetTheParametersOfTheController) {
  const std::string box = "plant_model/on_box", printed = "controller/printed";
  const std::string model = " plant_model:=" + (kRoot / "config/plant_model").string();
  for (const auto& [arguments, parameter, value] :
       {std::tuple<std::string, std::string, std::string>{"simulation.launch plant:=box", box, "true"},
        {"simulation.launch plant:=box support:=ground", box, "false"},
        {"simulation.launch support:=box", box, "true"},
        {"simulation.launch support:=ground", box, "false"},
        {"simulation.launch plant:=box" + model + ".yaml", box, "true"},
        {"simulation.launch plant:=real" + model + "_box.yaml", box, "false"},
        {"simulation.launch preset:=standard printed:=true", printed, "true"},
        {"jackal.launch preset:=tuned printed:=true", printed, "true"},
        {"simulation.launch preset:=standard", printed, "false"},
        {"simulation.launch", printed, ""},
        {"gazebo.launch", "plant_model/dead_time", "0.006"},
        {"gazebo.launch", "plant_model/acceleration_limit", "16.0"},
        {"gazebo.launch", "plant_model/effective_track", "0.42"},
        {"gazebo.launch", "plant_model/identified", ""}}) {
    const std::string dumped = output("roslaunch --dump-params jackal_aic " + arguments);
    const auto found_values = found(dumped, "/jackal_aic/" + parameter + ": (\\S+)");
    EXPECT_EQ(found_values, value.empty() ? std::set<std::string>{} : std::set<std::string>{value}) << arguments;
  }
}

/// Arguments that contradict each other, that nothing would come of, or that name nothing.
TEST(Launch, WrongArgumentsAreRefusedWithTheReason) {
  const std::string plants = "unknown plant: grond; choose ground, box, real or a file NAME.yaml";
  for (const auto& [arguments, reason] : std::map<std::string, std::string>{
           {"jackal.launch record_to:=drive", "record_to:=drive: needs record:=true"},
           {"jackal.launch preset:=improved slip_file:=/tmp/slip.yaml", "slip_file: needs preset:=predictive"},
           {"simulation.launch printed:=true", "printed:=true: needs preset:=standard, improved or tuned"},
           {"simulation.launch record_to:=drive", "record_to:=drive: needs record:=true"},
           {"simulation.launch plant:=grond", plants},
           {"identify.launch simulated:=true plant:=grond", plants},
           {"identify.launch plant:=box", "plant:=box: needs simulated:=true"},
           {"faults.launch plant:=box", "unknown plant: box; choose ground, real or a file NAME.yaml"}}) {
    const std::string said = output("roslaunch --dump-params jackal_aic " + arguments + " || true");
    EXPECT_NE(said.find(reason), std::string::npos) << arguments << "\n" << said;
  }
}

/// What is in a directory, with the paths in it.
std::set<std::string> contents(const fs::path& directory) {
  std::set<std::string> paths;
  for (const auto& entry : fs::recursive_directory_iterator(directory)) paths.insert(entry.path().string());
  return paths;
}

/// What a user has there is neither used nor thrown away.
TEST(Scripts, ADirectoryThatIsNotOursIsLeftAlone) {
  const fs::path workspace = testing::TempDir() + "other_workspace" + std::to_string(getpid());
  const std::string with = "! JACKAL_AIC_WS=" + workspace.string() + " timeout 60 " + (kRoot / "scripts").string();
  for (const char* theirs :
       {"build/work", "devel/work", "src/their_package/work", "log/sanitizer/work", "notes/work"}) {
    fs::create_directories(workspace / theirs);
    const auto before = contents(workspace);
    for (const char* script : {"/build", "/lint --quick", "/test --only drive_gate"}) {
      const std::string said = output(with + script);
      EXPECT_NE(said.find("set JACKAL_AIC_WS to an empty directory"), std::string::npos) << said;
      EXPECT_EQ(contents(workspace), before) << theirs << script;
    }
    fs::remove_all(workspace);
  }
  fs::create_directories(workspace.string() + "-address/log/sanitizer/work");
  EXPECT_NE(output(with + "/test --sanitize address").find("set JACKAL_AIC_WS"), std::string::npos);
  EXPECT_TRUE(fs::exists(workspace.string() + "-address/log/sanitizer/work"));
  fs::remove_all(workspace.string() + "-address");
}

/// The file that marks a workspace of the scripts may be a user's, or name another checkout.
TEST(Scripts, TheWorkspaceOfAnotherCheckoutIsLeftAlone) {
  const fs::path other = testing::TempDir() + "other_checkout" + std::to_string(getpid()), workspace = other / "ws";
  fs::create_directories(workspace / "build/work");
  std::ofstream(other / "package.xml") << "<package/>";
  for (const std::string& location : {other.string() + " " + fs::canonical(workspace).string(), std::string("Delft")}) {
    std::ofstream(workspace / "location") << location << "\n";
    const std::string said =
        output("! JACKAL_AIC_WS=" + workspace.string() + " timeout 60 " + (kRoot / "scripts/build").string());
    EXPECT_NE(said.find("set JACKAL_AIC_WS to an empty directory"), std::string::npos) << said;
    EXPECT_TRUE(fs::exists(workspace / "build/work")) << said;
  }
  fs::remove_all(other);
}

/// `scripts/test --only` asks this before it builds.
TEST(Scripts, TestBuildsWhatThePatternNeedsOrSaysThatThereIsNoSuchTest) {
  const auto targets = [](const std::string& pattern) {
    const std::string library = (kRoot / "scripts/lib/").string();
    return output("bash -c 'set -eu; . " + library + "progress.sh; . " + library + "tests.sh; test_targets " +
                  fs::path(JACKAL_AIC_BUILD).parent_path().string() + "/build \"" + pattern + "\"' 2>&1 || true");
  };
  EXPECT_EQ(targets("drive_gate"), "drive_gate_test\n");
  EXPECT_EQ(targets("test_gate__"), "all\n") << "a node test is one in Python";
  EXPECT_NE(targets("gtest.package").find("all\n"), std::string::npos) << "it starts every program";
  EXPECT_NE(targets("nosuch").find("--only nosuch: no test has such a name"), std::string::npos);
  EXPECT_NE(targets("(").find("--only (: no regular expression"), std::string::npos);
}

/// roslaunch says nothing of an argument that the file does not know.
TEST(Launch, FilesAroundTheControllersTakeItsArguments) {
  const std::map<std::string, std::set<std::string>> has_no{
      {"jackal", {}}, {"gazebo", {"cmd_drive"}}, {"simulation", {"cmd_drive", "output", "on_box", "respawn"}}};
  const std::set<std::string> arguments =
      found(textOf(kRoot / "launch/controller.launch"), "<arg name=\"(\\w+)\" default");
  EXPECT_GT(arguments.size(), 10u);
  const std::string slip_file = " slip_file:=/tmp/my_slip.yaml";
  for (const auto& [name, missing] : has_no) {
    const std::string launch = name + ".launch";
    const auto taken = found(textOf(kRoot / "launch" / launch), "<arg name=\"(\\w+)\" default");
    const auto passed = found(textOf(kRoot / "launch" / launch), "    <arg name=\"(\\w+)\" value");
    for (const std::string& argument : arguments) {
      if (missing.count(argument) > 0) continue;
      EXPECT_TRUE(taken.count(argument) > 0 && passed.count(argument) > 0) << argument << " of " << launch;
    }
    EXPECT_NE(output("roslaunch --dump-params jackal_aic " + launch + slip_file).find("slip/file: /tmp/my_slip.yaml"),
              std::string::npos)
        << launch;
  }
}

/// The stock control.launch loads the file of JACKAL_CONTROL_EXTRAS_PATH with subst_value, which substitutes in
/// comments too and refuses what it does not know.
TEST(Launch, NoConfigurationAsksForASubstitution) {
  int files = 0;
  for (const auto& entry : fs::directory_iterator(kRoot / "config")) {
    EXPECT_EQ(textOf(entry.path()).find("$("), std::string::npos) << entry.path();
    ++files;
  }
  EXPECT_GT(files, 10);
}

TEST(Launch, TheControllerKnowsItsPresetAndItsFiles) {
  const std::string text = output("roslaunch --dump-params jackal_aic simulation.launch preset:=improved");
  EXPECT_NE(text.find("/jackal_aic/preset: improved\n"), std::string::npos) << text;
  const auto files = found(text, "/jackal_aic/parameter_files: ([^/]*/[^:]*)\n/");
  ASSERT_EQ(files.size(), 1u) << text;
  for (const char* file : {"improved.yaml", "jackal.yaml", "plant_model.yaml"}) {
    EXPECT_NE(files.begin()->find(file), std::string::npos) << *files.begin();
  }
}

/// From the start of the launch file to Ctrl-C: every line of the log is one that its user would miss.
TEST(Log, OfADriveTellsWhatHappensAndNoMore) {
  const std::string text = output("bash " + (kRoot / "test/package/drive_once").string());
  std::vector<std::string> lines;
  const std::regex logged("\\[ *(INFO|WARN|ERROR|FATAL)\\] \\[[\\d., ]+\\]: ([^\\n\x1b]*)");
  for (std::sregex_iterator i(text.begin(), text.end(), logged), end; i != end; ++i)
    lines.push_back((*i)[1].str() + " " + (*i)[2].str());
  const std::vector<std::string> expected{"INFO Preset predictive, parameters from ",
                                          "INFO Plant model: ",
                                          "INFO Stable with room: ",
                                          "INFO Ready (predictive). Waiting for set points on /jackal_AIC/set_point",
                                          "INFO Driving",
                                          "INFO Stopped: no set point for 0.5 s",
                                          "INFO Stopping; wheels at zero"};
  ASSERT_EQ(lines.size(), expected.size()) << text;
  for (std::size_t i = 0; i < lines.size(); ++i) EXPECT_EQ(lines[i].find(expected[i]), 0u) << lines[i];
}

/// A package that is not instrumented itself cannot be linked with libraries that are.
class Downstream : public testing::Test {
 protected:
  void SetUp() override {
    if (*JACKAL_AIC_SANITIZER != '\0') GTEST_SKIP() << "the libraries are instrumented: " JACKAL_AIC_SANITIZER;
  }
};

/// Builds test/downstream against a space of this workspace, and runs it.
void expectUsable(const std::string& space, const std::string& name) {
  const std::string build = JACKAL_AIC_BUILD "/downstream_" + name;
  output("sh " + (kRoot / "test/downstream/check").string() + " " + space + " " + build);
}

TEST_F(Downstream, BuildsAgainstTheInstallSpace) {
  fs::remove_all(JACKAL_AIC_INSTALL "/lib/jackal_aic");  // an earlier version installed other programs there
  output("cmake -P " JACKAL_AIC_BUILD "/cmake_install.cmake");
  expectUsable(JACKAL_AIC_INSTALL, "install");
  const std::set<std::string> programs = completed(JACKAL_AIC_INSTALL);
  if (programs.empty()) GTEST_SKIP() << "no completion by rosbash";
  EXPECT_EQ(programs, listed("For users"));
  std::set<std::string> internal = listed("Started by launch files");
  internal.merge(listed("Examples and measurements"));
  EXPECT_EQ(namesIn(JACKAL_AIC_INSTALL "/share/jackal_aic/build"), internal);
  output("bash -c '. " JACKAL_AIC_INSTALL "/setup.bash; roslaunch --args /jackal_aic jackal_aic jackal.launch'");
}

TEST_F(Downstream, PythonTakesModuleAndFilesOfTheInstallSpace) {
  output("cmake -P " JACKAL_AIC_BUILD "/cmake_install.cmake");
  // A robot that no other space has: it rests 0.4 s after the set point.
  std::ofstream(JACKAL_AIC_INSTALL "/share/jackal_aic/config/plant.yaml") << "plant: {dead_time: 0.5}\n";
  const std::string drive =
      "import jackal_aic, jackal_aic.msg, os\n"
      "assert os.path.exists(os.path.join(os.path.dirname(jackal_aic.__file__), \"__init__.pyi\"))\n"
      "drive = jackal_aic.simulate(\"ground\", \"diff_drive\", (0.5, 0.0))\n"
      "print(jackal_aic.__file__, abs(drive.speed[900]) < 0.01, drive.speed[-1] > 0.4)\n";
  const std::string printed = output(
      "env -u PYTHONPATH -u CMAKE_PREFIX_PATH -u ROS_PACKAGE_PATH -u LD_LIBRARY_PATH bash -c '. " JACKAL_AIC_INSTALL
      "/setup.bash; cd /; /usr/bin/python3 -c \"$0\"' '" +
      drive + "'");
  output("cmake -P " JACKAL_AIC_BUILD "/cmake_install.cmake");
  EXPECT_EQ(printed.rfind(JACKAL_AIC_INSTALL "/", 0), 0u) << printed;
  EXPECT_NE(printed.find(" True True\n"), std::string::npos) << printed;
}

}  // namespace
}  // namespace jackal_aic
