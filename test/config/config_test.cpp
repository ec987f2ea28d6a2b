#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <regex>
#include <string>
#include <thread>

#include "../complaint.hpp"
#include "../temporary_directory.hpp"
#include "jackal_aic/aic/parameters.hpp"
#include "jackal_aic/config/parameter_map.hpp"
#include "jackal_aic/config/text.hpp"
#include "jackal_aic/config/urdf_geometry.hpp"
#include "jackal_aic/config/yaml.hpp"

namespace jackal_aic {
namespace {

class TextFile : public testing::Test, protected TemporaryDirectory {};

void expectRefused(const std::string& path, const std::string& reason) {
  EXPECT_EQ(complaint([&] { readText(path, 1 << 20); }), path + ": " + reason);
}

TEST_F(TextFile, IsReadUpToItsBound) {
  const std::string text(100000, 'x');
  std::ofstream(path("file")) << text;
  EXPECT_EQ(readText(path("file")), text);
  EXPECT_EQ(readText(path("file"), text.size()), text);
  EXPECT_THROW(readText(path("file"), text.size() - 1), ParameterError);
  std::ofstream(path("empty")).flush();
  EXPECT_EQ(readText(path("empty")), "");
}

TEST_F(TextFile, LargeOneOrWhatIsNoFileIsRefusedUnread) {
  std::ofstream(path("large")).flush();
  std::filesystem::resize_file(path("large"), std::uintmax_t{1} << 40);  // without any bytes on the disk
  expectRefused(path("large"), "more than 1 MiB of text");
  expectRefused(path("none"), "cannot be read");
  expectRefused(path(), "is a directory");
  std::filesystem::create_symlink("/dev/zero", path("zero"));
  expectRefused(path("zero"), "is a device or a socket, not a file");
  expectRefused("/dev/null", "is a device or a socket, not a file");
}

TEST_F(TextFile, PipeIsReadToItsEnd) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  const std::string text(150000, 'y');  // more than a pipe holds
  std::thread writer([&] {
    ASSERT_EQ(::write(ends[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
    close(ends[1]);
  });
  EXPECT_EQ(readText("/dev/fd/" + std::to_string(ends[0])), text);
  writer.join();
  close(ends[0]);
}

TEST(YamlQuoted, StaysTheSameTextForEveryReader) {
  for (const std::string text : {"our Jackal", "1e5", "true", "a: \"b\" # c", "back\\slash", ""}) {
    ParameterMap map;
    addYamlText("robot: " + yamlQuoted(text) + "\n", "text", map);
    EXPECT_EQ(std::get<std::string>(*map.take("robot")), text);
  }
  EXPECT_EQ(yamlQuoted("two\nlines"), "\"two lines\"");
}

TEST(YamlNumber, IsReadBackAsItWas) {
  // Floating-point numbers of YAML 1.1 as rosparam's reader knows them; those of YAML 1.2 include them.
  const std::regex number("-?[0-9]+\\.[0-9]+(e[-+][0-9]+)?");
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> exponent(-300.0, 300.0), mantissa(-1.0, 1.0);
  for (int i = 0; i < 10000; ++i) {
    const double value = mantissa(generator) * std::pow(10.0, exponent(generator));
    const std::string text = yamlNumber(value);
    ASSERT_TRUE(std::regex_match(text, number)) << text;
    ASSERT_EQ(std::strtod(text.c_str(), nullptr), value) << text;
    ASSERT_TRUE(std::regex_match(yamlNumber(value, 3), number)) << yamlNumber(value, 3);
  }
  for (const double bad : {HUGE_VAL, std::nan("")}) EXPECT_THROW(yamlNumber(bad), ParameterError);
}

TEST(YamlBlock, HasEveryFieldWithItsUnit) {
  ControllerParameters gains;
  gains.tau = 0.02;
  gains.state_variances = {1.0, 1e8};
  const std::string text = yamlBlock("controller", gains);
  expectSays(text, {"controller:\n  belief_rate: 50.0  # Hz\n", "\n  integrator: exact\n  orders: 3\n",
                    "\n  state_variances: [1.0, 1.0e+08]\n"});
  ParameterMap map;
  addYamlText(text, "text", map);
  EXPECT_EQ(readParameters<ControllerParameters>(map, "controller").tau, 0.02);
  EXPECT_NO_THROW(map.refuseUnknown());
}

TEST(OnOneLine, EscapesWhatATerminalObeysAndIsCutBetweenCharacters) {
  EXPECT_EQ(onOneLine("two\nlines\tand\r\n"), "two lines and  ");
  EXPECT_EQ(onOneLine("\x1b[31m\x07\x7f"), "\\x1b[31m\\x07\\x7f");
  EXPECT_EQ(onOneLine(std::string("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(onOneLine("J\u00f6rg"), "J\u00f6rg");
  const std::string before(79, 'a');
  EXPECT_EQ(shortened(before + "b"), before + "b");
  EXPECT_EQ(shortened(before + "\u00e9\u00e9"), before + "...");
  EXPECT_EQ(shortened(before.substr(1) + "\u00e9\u00e9"), before.substr(1) + "\u00e9...");
  EXPECT_EQ(shortened("abcdef", 3), "abc...");
}

constexpr const char* kCylinder = "<cylinder radius='0.1' length='0.04'/>";

/// One wheel that hangs on the base, by a joint at xyz.
std::string wheel(const std::string& name, const std::string& xyz, const std::string& geometry = kCylinder) {
  return "<link name='" + name + "_link'><collision><geometry>" + geometry + "</geometry></collision></link>" +
         "<joint name='" + name + "' type='continuous'><parent link='base'/><child link='" + name + "_link'/>" +
         "<origin xyz='" + xyz + "' rpy='0 0 0'/><axis xyz='0 1 0'/></joint>";
}

std::string robot(const std::string& content) { return "<robot name='r'><link name='base'/>" + content + "</robot>"; }

std::string refusal(const std::string& urdf) {
  return complaint([&] { readUrdfGeometry(urdf, {"left"}, {"right"}); });
}

TEST(UrdfGeometry, ReadsSphereAndFallsBackToVisual) {
  const std::string sphere = wheel("left", "0 0.2 0", "<sphere radius='0.1'/>");
  const std::string visual = std::regex_replace(sphere, std::regex("collision"), "visual");
  const std::string urdf = robot(visual + wheel("right", "0 -0.2 0"));
  EXPECT_DOUBLE_EQ(readUrdfGeometry(urdf, {"left"}, {"right"}).wheel_radius, 0.1);
}

/// A robot whose base is turned about z against the root.
std::string turned(const std::string& angle, const std::string& wheels) {
  return "<robot name='r'><link name='root'/><link name='base'/><joint name='turn' type='fixed'><parent link='root'/>"
         "<child link='base'/><origin xyz='1 0 0' rpy='0 0 " +
         angle + "'/></joint>" + wheels + "</robot>";
}

TEST(UrdfGeometry, MeasuresTheTrackAlongYOfTheBaseFrameElseOfTheRoot) {
  const std::string along_x = wheel("left", "0.3 0 0") + wheel("right", "-0.3 0 0");
  EXPECT_NEAR(readUrdfGeometry(turned("1.5707963267948966", along_x), {"left"}, {"right"}).track, 0.6, 1e-12);
  const std::string along_y = wheel("left", "0 0.3 0") + wheel("right", "0 -0.3 0");
  for (const char* angle : {"0.7853981633974483", "1.5707963267948966", "3.141592653589793"}) {
    for (const char* base : {"base", "/base"}) {
      EXPECT_NEAR(readUrdfGeometry(turned(angle, along_y), {"left"}, {"right"}, base).track, 0.6, 1e-12) << angle;
    }
  }
  EXPECT_NEAR(readUrdfGeometry(robot(along_y), {"left"}, {"right"}, "no_link_of_it").track, 0.6, 1e-12) << "the root";
}

/// A robot whose right wheel is fine, and whose left one has a text replaced.
std::string withLeft(const std::string& original, const std::string& replacement) {
  std::string left = wheel("left", "0 0.2 0");
  left.replace(left.find(original), original.size(), replacement);
  return robot(left + wheel("right", "0 -0.2 0"));
}

TEST(UrdfGeometry, RefusesRobotsThatCannotBeWithTheReason) {
  const std::string left = wheel("left", "0 0.2 0"), box = "<box size='1 1 1'/>";
  const std::pair<std::string, std::string> rows[] = {
      {"", "URDF: cannot be parsed"},
      {"<robot", "URDF: cannot be parsed"},
      {"<robot name='r'/>", "URDF: cannot be parsed"},
      {robot(left), "URDF: no joint 'right'"},
      {withLeft("continuous", "fixed"),
       "URDF: wheel joint 'left' does not turn: its type must be continuous or revolute"},
      {withLeft(kCylinder, box), "URDF: link 'left_link' has no cylinder or sphere with a positive radius"},
      {robot(left + wheel("right", "0 -0.2 0", "<sphere radius='0.09'/>")),
       "URDF: wheel of joint 'right' has radius 0.09 m: must be equal to the first wheel's 0.1 m"},
      {withLeft("xyz='0 1 0'", "xyz='0 -1 0'"),
       "URDF: axis of wheel joint 'left' points to the right: must point to the left, or its speed is negative "
       "when the robot drives forward; turn the axis, or the joint, round"}};
  for (const auto& [urdf, message] : rows) {
    EXPECT_EQ(refusal(urdf).find(message), 0u) << message << "\n" << refusal(urdf);
  }
  const std::string swapped = robot(wheel("left", "0 -0.2 0") + wheel("right", "0 0.2 0"));
  expectSays(refusal(swapped), {"must lie further left"});
}

TEST(UrdfGeometry, QuotesNamesOfTheFileOnOneLine) {
  const std::string name = "&#10;FATAL forged &#27;[31m" + std::string(500, 'x');
  const std::string box = wheel("left", "0 0.2 0", "<box size='1 1 1'/>");
  const std::string line = refusal(robot(std::regex_replace(box, std::regex("left_link"), name)));
  expectSays(line, {"has no cylinder or sphere"});
  EXPECT_EQ(line.find_first_of("\n\x1b"), std::string::npos) << line;
  EXPECT_LT(line.size(), 200u) << line;
}

}  // namespace
}  // namespace jackal_aic
