#include "jackal_aic/config/urdf_geometry.hpp"

#include <gtest/gtest.h>

#include <string>

#include "../complaint.hpp"

namespace jackal_aic {
namespace {

/// One wheel that hangs on the base, by a joint at xyz.
std::string wheel(const std::string& name, const std::string& xyz, const std::string& geometry) {
  return "<link name='" + name + "_link'><collision><geometry>" + geometry + "</geometry></collision></link>" +
         "<joint name='" + name + "' type='continuous'><parent link='base'/><child link='" + name + "_link'/>" +
         "<origin xyz='" + xyz + "' rpy='0 0 0'/><axis xyz='0 1 0'/></joint>";
}

std::string robot(const std::string& content) { return "<robot name='r'><link name='base'/>" + content + "</robot>"; }

constexpr const char* kCylinder = "<cylinder radius='0.1' length='0.04'/>";

std::string refusal(const std::string& urdf) {
  return complaint([&] { readUrdfGeometry(urdf, {"left"}, {"right"}); });
}

TEST(UrdfGeometry, ReadsSphereAndFallsBackToVisual) {
  std::string sphere = wheel("left", "0 0.2 0", "<sphere radius='0.1'/>");
  for (std::size_t at; (at = sphere.find("collision")) != std::string::npos;) sphere.replace(at, 9, "visual");
  const std::string urdf = robot(sphere + wheel("right", "0 -0.2 0", kCylinder));
  EXPECT_DOUBLE_EQ(readUrdfGeometry(urdf, {"left"}, {"right"}).wheel_radius, 0.1);
}

/// A robot whose base is turned about z against the root.
std::string turned(const std::string& angle, const std::string& wheels) {
  return "<robot name='r'><link name='root'/><link name='base'/><joint name='turn' type='fixed'><parent link='root'/>"
         "<child link='base'/><origin xyz='1 0 0' rpy='0 0 " +
         angle + "'/></joint>" + wheels + "</robot>";
}

TEST(UrdfGeometry, MeasuresTheTrackAlongYOfTheBaseFrameElseOfTheRoot) {
  const std::string along_x = wheel("left", "0.3 0 0", kCylinder) + wheel("right", "-0.3 0 0", kCylinder);
  EXPECT_NEAR(readUrdfGeometry(turned("1.5707963267948966", along_x), {"left"}, {"right"}).track, 0.6, 1e-12);
  const std::string along_y = wheel("left", "0 0.3 0", kCylinder) + wheel("right", "0 -0.3 0", kCylinder);
  for (const char* angle : {"0.7853981633974483", "1.5707963267948966", "3.141592653589793"}) {
    for (const char* base : {"base", "/base"}) {
      EXPECT_NEAR(readUrdfGeometry(turned(angle, along_y), {"left"}, {"right"}, base).track, 0.6, 1e-12) << angle;
    }
  }
  EXPECT_NEAR(readUrdfGeometry(robot(along_y), {"left"}, {"right"}, "no_link_of_it").track, 0.6, 1e-12) << "the root";
}

/// A robot whose right wheel is fine, and whose left one has a text replaced.
std::string withLeft(const std::string& original, const std::string& replacement) {
  std::string left = wheel("left", "0 0.2 0", kCylinder);
  left.replace(left.find(original), original.size(), replacement);
  return robot(left + wheel("right", "0 -0.2 0", kCylinder));
}

TEST(UrdfGeometry, RefusesRobotsThatCannotBeWithTheReason) {
  const std::string left = wheel("left", "0 0.2 0", kCylinder), box = "<box size='1 1 1'/>";
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
  const std::string swapped = robot(wheel("left", "0 -0.2 0", kCylinder) + wheel("right", "0 0.2 0", kCylinder));
  expectSays(refusal(swapped), {"must lie further left"});
}

TEST(UrdfGeometry, QuotesNamesOfTheFileOnOneLine) {
  const std::string name = "&#10;FATAL forged &#27;[31m" + std::string(500, 'x');
  std::string left = wheel("left", "0 0.2 0", "<box size='1 1 1'/>");
  for (std::size_t at; (at = left.find("left_link")) != std::string::npos;) left.replace(at, 9, name);
  const std::string line = refusal(robot(left));
  expectSays(line, {"has no cylinder or sphere"});
  EXPECT_EQ(line.find_first_of("\n\x1b"), std::string::npos) << line;
  EXPECT_LT(line.size(), 200u) << line;
}

}  // namespace
}  // namespace jackal_aic
