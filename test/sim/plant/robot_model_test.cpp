#include "robot_model.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "../../complaint.hpp"
#include "jackal_aic/config/urdf_geometry.hpp"
#include "test_plant.hpp"

namespace jackal_aic::sim {
namespace {

std::string refusal(const std::string& urdf) {
  return complaint([&] { readRobotModel(urdf); });
}

TEST(RobotModel, LumpsLinksOnFixedJoints) {
  // 2 kg, 0.3 m above the chassis' centre of mass, turned by 90 degrees about z.
  const std::string urdf = jackalUrdfWith("</robot>", R"(
    <link name="load"><inertial><origin xyz="0 0 0"/><mass value="2"/>
      <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.3"/></inertial></link>
    <joint name="load_joint" type="fixed"><parent link="chassis_link"/><child link="load"/>
      <origin xyz="0.012 0.002 0.367" rpy="0 0 1.5707963267948966"/></joint></robot>)");
  const RobotModel plain = readRobotModel(jackalUrdf());
  const RobotModel loaded = readRobotModel(urdf);
  const double mass = plain.chassis.mass;
  EXPECT_DOUBLE_EQ(loaded.chassis.mass, mass + 2.0);
  EXPECT_NEAR(loaded.chassis.centre.z(), (mass * 0.067 + 2.0 * 0.367) / (mass + 2.0), 1e-12);
  const double steiner = mass * 2.0 / (mass + 2.0) * 0.3 * 0.3;
  EXPECT_NEAR(loaded.chassis.inertia(0, 0), plain.chassis.inertia(0, 0) + 0.2 + steiner, 1e-12);
  EXPECT_NEAR(loaded.chassis.inertia(1, 1), plain.chassis.inertia(1, 1) + 0.1 + steiner, 1e-12);
  EXPECT_NEAR(loaded.chassis.inertia(2, 2), plain.chassis.inertia(2, 2) + 0.3, 1e-12);
}

/// The Jackal without the inertia of a wheel.
std::string withoutInertia() {
  std::string urdf = jackalUrdf();
  const auto begin = urdf.find("<inertial>", urdf.find("front_left_wheel_link"));
  return urdf.erase(begin, urdf.find("</inertial>", begin) + std::string("</inertial>").size() - begin);
}

TEST(RobotModel, RefusesRobotsThatCannotDriveOrExist) {
  const std::pair<std::string, const char*> rows[] = {
      {jackalUrdfWith("joint name=\"rear_left_wheel\"", "joint name=\"rl\""), "no joint 'rear_left_wheel'"},
      {jackalUrdfWith("<mass value=\"0.477\"/>", "<mass value=\"0\"/>"), "wheel 'front_left_wheel_link': mass 0 kg"},
      {withoutInertia(), "wheel 'front_left_wheel_link': mass 0 kg, principal inertia 0 to 0 kg m^2"},
      {jackalUrdfWith("ixx=\"0.3136\"", "ixx=\"-0.3136\""),
       "the chassis: mass 16.523 kg, principal inertia -0.313954 to 0.448868 kg m^2, centre of mass 0.0680955 m away: "
       "must be in [0.001, 10000] kg, [1e-09, 100000] kg m^2 and within 100 m"},
      {jackalUrdfWith("<axis xyz=\"0 1 0\"/>", "<axis xyz=\"0 -1 0\"/>"),
       "joint 'front_left_wheel' must turn about +y of base_link (positive is forward)"},
      {jackalUrdfWith("type=\"continuous\"", "type=\"fixed\""),
       "wheel joint 'front_left_wheel' does not turn: its type must be continuous or revolute"},
      {"<robot name='r'><link name='base_link'/></robot>", "no link 'imu_link'"},
      {jackalUrdfWith("<mass value=\"16.523\"/>", "<mass value=\"1e300\"/>"), "the chassis: mass 1e+300 kg"},
      {jackalUrdfWith("ixx=\"0.3136\"", "ixx=\"1e300\""), "the chassis: "},
      {jackalUrdfWith("ixx=\"0.0013\"", "ixx=\"1e-300\""), "wheel 'front_left_wheel_link': "},
      {jackalUrdfWith("xyz=\"0.012 0.002 0.067\"", "xyz=\"0.012 1e300 0.067\""), "the chassis: "},
      {jackalUrdfWith("<mass value=\"0.477\"/>", "<mass value=\"nan\"/>"),
       "link 'front_left_wheel_link' has no cylinder or sphere with a positive radius"}};
  for (const auto& [urdf, message] : rows) {
    EXPECT_EQ(refusal(urdf).find(std::string("URDF: ") + message), 0u) << refusal(urdf);
  }
  EXPECT_EQ(refusal(jackalUrdfWith("<material name=\"dark_grey\">", "<!-- 100 % --><material name=\"dark_grey\">")),
            "");
}

}  // namespace
}  // namespace jackal_aic::sim
