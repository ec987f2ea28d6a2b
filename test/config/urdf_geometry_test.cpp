#include "jackal_aic/config/urdf_geometry.hpp"

#include <gtest/gtest.h>

#include <string>

namespace jackal_aic {
namespace {

/// One wheel that hangs on a base turned by rpy, by a joint at xyz.
std::string wheel(const std::string& name, const std::string& xyz, const std::string& geometry) {
  return "<link name='" + name + "_link'><collision><geometry>" + geometry + "</geometry></collision></link>" +
         "<joint name='" + name + "' type='continuous'><parent link='base'/><child link='" + name + "_link'/>" +
         "<origin xyz='" + xyz + "' rpy='0 0 0'/><axis xyz='0 1 0'/></joint>";
}

std::string robot(const std::string& content) { return "<robot name='r'><link name='base'/>" + content + "</robot>"; }

constexpr const char* kCylinder = "<cylinder radius='0.1' length='0.04'/>";

std::string complaint(const std::string& urdf) {
  try {
    readUrdfGeometry(urdf, {"left"}, {"right"});
  } catch (const ParameterError& error) {
    return error.what();
  }
  return "";
}

TEST(UrdfGeometry, ReadsRadiusAndTrack) {
  const std::string urdf = robot(wheel("left", "0.2 0.25 0", kCylinder) + wheel("right", "-0.2 -0.15 0", kCylinder));
  const UrdfGeometry geometry = readUrdfGeometry(urdf, {"left"}, {"right"});
  EXPECT_DOUBLE_EQ(geometry.wheel_radius, 0.1);
  EXPECT_NEAR(geometry.track, 0.4, 1e-12);
}

TEST(UrdfGeometry, ReadsSphereAndFallsBackToVisual) {
  std::string sphere = wheel("left", "0 0.2 0", "<sphere radius='0.1'/>");
  for (std::size_t at; (at = sphere.find("collision")) != std::string::npos;) sphere.replace(at, 9, "visual");
  const std::string urdf = robot(sphere + wheel("right", "0 -0.2 0", kCylinder));
  EXPECT_DOUBLE_EQ(readUrdfGeometry(urdf, {"left"}, {"right"}).wheel_radius, 0.1);
}

TEST(UrdfGeometry, MeasuresTheTrackAlongYOfTheRoot) {
  // A joint between root and axle that turns by 90 degrees about z makes -x of the axle y of the root.
  const std::string urdf =
      "<robot name='r'><link name='root'/><link name='base'/><joint name='turn' type='fixed'><parent link='root'/>"
      "<child link='base'/><origin xyz='0 0 0' rpy='0 0 1.5707963267948966'/></joint>" +
      wheel("left", "0.3 0 0", kCylinder) + wheel("right", "-0.3 0 0", kCylinder) + "</robot>";
  EXPECT_NEAR(readUrdfGeometry(urdf, {"left"}, {"right"}).track, 0.6, 1e-12);
}

/// A base frame that is turned against the root.
TEST(UrdfGeometry, SidesAreThoseOfTheBaseFrame) {
  const std::string wheels = wheel("left", "0 0.3 0", kCylinder) + wheel("right", "0 -0.3 0", kCylinder);
  for (const char* turn : {"0.7853981633974483", "1.5707963267948966", "3.141592653589793"}) {
    const std::string urdf =
        std::string("<robot name='r'><link name='root'/><link name='base'/><joint name='turn' type='fixed'>") +
        "<parent link='root'/><child link='base'/><origin xyz='1 0 0' rpy='0 0 " + turn + "'/></joint>" + wheels +
        "</robot>";
    EXPECT_NEAR(readUrdfGeometry(urdf, {"left"}, {"right"}, "base").track, 0.6, 1e-12) << turn;
    EXPECT_NEAR(readUrdfGeometry(urdf, {"left"}, {"right"}, "/base").track, 0.6, 1e-12) << turn;
  }
  EXPECT_NEAR(readUrdfGeometry(robot(wheels), {"left"}, {"right"}, "no_link_of_it").track, 0.6, 1e-12) << "the root";
}

TEST(UrdfGeometry, RefusesTextThatIsNoUrdf) {
  EXPECT_EQ(complaint("").find("URDF: cannot be parsed"), 0u);
  EXPECT_EQ(complaint("<robot").find("URDF: cannot be parsed"), 0u);
  EXPECT_EQ(complaint("<robot name='r'/>").find("URDF: cannot be parsed"), 0u);
  EXPECT_EQ(complaint("<robot").find('\n'), std::string::npos);
}

/// A link and a joint above it.
std::string linkBelow(const std::string& parent, const std::string& name) {
  return "<link name='" + name + "'/><joint name='above_" + name + "' type='fixed'><parent link='" + parent +
         "'/><child link='" + name + "'/></joint>";
}

TEST(UrdfGeometry, RefusesLinksThatHangOnEachOther) {
  const std::string right = wheel("right", "0 -0.2 0", kCylinder);
  // The left wheel hangs on a link that hangs on the wheel.
  std::string circle = wheel("left", "0 0.2 0", kCylinder) + linkBelow("left_link", "loop");
  circle.replace(circle.find("parent link='base'"), 18, "parent link='loop'");
  EXPECT_EQ(complaint(robot(circle + right)), "URDF: link 'left_link' does not hang on the root link 'base'");
  std::string itself = wheel("left", "0 0.2 0", kCylinder);
  itself.replace(itself.find("parent link='base'"), 18, "parent link='left_link'");
  EXPECT_EQ(complaint(robot(itself + right)), "URDF: link 'left_link' does not hang on the root link 'base'");
}

TEST(UrdfGeometry, RefusesATextBeyondTheSizeOfARobot) {
  std::string chain;
  for (int i = 0; i < 20000; ++i) {
    chain += linkBelow(i == 0 ? std::string("base") : "l" + std::to_string(i - 1), "l" + std::to_string(i));
  }
  EXPECT_EQ(complaint(robot(chain)), "URDF: more than 1000 links");
  EXPECT_EQ(complaint(robot("<!--" + std::string(16 << 20, '-') + ">")), "URDF: more than 16 MiB of text");
  std::string nested;
  for (int i = 0; i < 20000; ++i) nested += "<a>";
  EXPECT_EQ(complaint(robot(nested)).find("URDF: "), 0u);
}

TEST(UrdfGeometry, QuotesNamesOfTheFileOnOneLine) {
  const std::string name = "&#10;FATAL forged &#27;[31m" + std::string(500, 'x');
  std::string left = wheel("left", "0 0.2 0", "<box size='1 1 1'/>");
  for (std::size_t at; (at = left.find("left_link")) != std::string::npos;) left.replace(at, 9, name);
  const std::string line = complaint(robot(left));
  EXPECT_NE(line.find("has no cylinder or sphere"), std::string::npos) << line;
  EXPECT_EQ(line.find_first_of("\n\x1b"), std::string::npos) << line;
  EXPECT_LT(line.size(), 200u) << line;
}

TEST(UrdfGeometry, TextOfTheFileIsNoPrintfFormat) {
  const std::string text = complaint(robot(wheel("left", "0 %n%s%s%s%s%s%s 0", kCylinder)));
  EXPECT_NE(text.find("with a '%' in it"), std::string::npos) << text;
  const std::string comment = "<!-- 100 % -->";
  const std::string urdf = robot(comment + wheel("left", "0 0.2 0", kCylinder) + wheel("right", "0 -0.2 0", kCylinder));
  EXPECT_NEAR(readUrdfGeometry(urdf, {"left"}, {"right"}).track, 0.4, 1e-12);
}

TEST(UrdfGeometry, NamesTheMissingJoint) {
  EXPECT_EQ(complaint(robot(wheel("left", "0 0.2 0", kCylinder))), "URDF: no joint 'right'");
}

TEST(UrdfGeometry, RefusesAWheelThatDoesNotTurn) {
  std::string left = wheel("left", "0 0.2 0", kCylinder);
  left.replace(left.find("continuous"), 10, "fixed");
  EXPECT_EQ(complaint(robot(left + wheel("right", "0 -0.2 0", kCylinder))),
            "URDF: wheel joint 'left' does not turn: its type must be continuous or revolute");
}

TEST(UrdfGeometry, RefusesAWheelWithoutRadius) {
  const std::string box = wheel("right", "0 -0.2 0", "<box size='1 1 1'/>");
  EXPECT_EQ(complaint(robot(wheel("left", "0 0.2 0", kCylinder) + box)),
            "URDF: link 'right_link' has no cylinder or sphere with a positive radius");
}

TEST(UrdfGeometry, NamesTheOmittedPartsOfAWheelWithoutRadius) {
  std::string left = wheel("left", "0 0.2 0", kCylinder);
  const std::string link = "<link name='left_link'>";
  ASSERT_NE(left.find(link), std::string::npos) << left;
  left.insert(left.find(link) + link.size(),
              "<inertial><mass value='nan'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>");
  EXPECT_EQ(complaint(robot(left + wheel("right", "0 -0.2 0", kCylinder))),
            "URDF: link 'left_link' has no cylinder or sphere with a positive radius; left out of the URDF: Inertial: "
            "mass [nan] is not a float; Could not parse inertial element for Link [left_link]");
}

TEST(UrdfGeometry, RefusesUnequalRadii) {
  const std::string smaller = wheel("right", "0 -0.2 0", "<sphere radius='0.09'/>");
  EXPECT_EQ(complaint(robot(wheel("left", "0 0.2 0", kCylinder) + smaller)),
            "URDF: wheel of joint 'right' has radius 0.09 m: must be equal to the first wheel's 0.1 m");
}

TEST(UrdfGeometry, RefusesAWheelThatTurnsBackwards) {
  std::string right = wheel("right", "0 -0.2 0", kCylinder);
  right.replace(right.find("0 1 0"), 5, "0 -1 0");
  EXPECT_EQ(complaint(robot(wheel("left", "0 0.2 0", kCylinder) + right)),
            "URDF: axis of wheel joint 'right' points to the right: must point to the left, or its speed is negative "
            "when the robot drives forward; turn the axis, or the joint, round");
}

TEST(UrdfGeometry, RefusesSwappedSides) {
  const std::string message =
      complaint(robot(wheel("left", "0 -0.2 0", kCylinder) + wheel("right", "0 0.2 0", kCylinder)));
  EXPECT_NE(message.find("must lie further left"), std::string::npos) << message;
}

}  // namespace
}  // namespace jackal_aic
