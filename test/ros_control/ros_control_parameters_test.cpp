#include "ros_control_parameters.hpp"

#include <gtest/gtest.h>

#include <tuple>

#include "../complaint.hpp"
#include "../repository.hpp"
#include "jackal_aic/config/yaml.hpp"

namespace jackal_aic {
namespace {

/// The least that a robot has to say.
ParameterMap bare() {
  ParameterMap map;
  map.set("left_wheel", std::string("front_left_wheel"));
  map.set("right_wheel", std::string("front_right_wheel"));
  return map;
}

RosControlParameters read(const ParameterMap& map) { return readRosControlParameters(map, jackalUrdf); }

std::string refusal(const ParameterMap& map, const std::string& urdf = jackalUrdf()) {
  return complaint([&] { readRosControlParameters(map, [&] { return urdf; }); });
}

TEST(RosControlParameters, GeometryComesFromTheUrdfUnlessGiven) {
  ParameterMap map = bare();
  const auto by_urdf = read(map);
  EXPECT_NEAR(by_urdf.wheel_separation, 0.37559, 1e-6);
  EXPECT_NEAR(by_urdf.drive.geometry.wheel_radius, 0.098, 1e-6);
  map.set("wheel_separation", 0.4);
  map.set("wheel_radius", 0.1);
  map.set("wheel_separation_multiplier", 1.5);
  const auto given = readRosControlParameters(map, [] { return std::string(); });
  EXPECT_EQ(given.drive.geometry.wheel_radius, 0.1);
  EXPECT_NEAR(given.drive.geometry.effective_track, 0.6, 1e-12);
}

TEST(RosControlParameters, ARadiusMultiplierOfBothSidesCountsFirst) {
  ParameterMap map = bare();
  map.set("left_wheel_radius_multiplier", 0.9);
  map.set("right_wheel_radius_multiplier", 1.1);
  EXPECT_EQ(read(map).live.left_wheel_radius_multiplier, 0.9);
  EXPECT_EQ(read(map).live.right_wheel_radius_multiplier, 1.1);
  map.set("wheel_radius_multiplier", 1.02);
  EXPECT_EQ(read(map).live.left_wheel_radius_multiplier, 1.02);
  EXPECT_EQ(read(map).live.right_wheel_radius_multiplier, 1.02);
}

TEST(RosControlParameters, LimitsAreThoseOfTheGateUnlessItHasItsOwn) {
  ParameterMap map = bare();
  addYamlText(
      "linear.x: {has_velocity_limits: true, max_velocity: 1.0, min_velocity: -0.5, has_acceleration_limits: true, "
      "max_acceleration: 1.0, min_acceleration: -0.5, has_jerk_limits: false, max_jerk: 5.0}\n"
      "angular.z: {max_velocity: 1.0, has_velocity_limits: false}",
      "text", map);
  const auto limits = read(map).drive.gate.limits;
  EXPECT_EQ(limits.linear_speed, 1.0);
  EXPECT_EQ(limits.linear_acceleration, 1.0);
  EXPECT_EQ(limits.linear_deceleration, 0.5);
  EXPECT_EQ(limits.angular_speed, LimitParameters{}.angular_speed);
  const auto brake = read(map).drive.gate.brake;
  EXPECT_EQ(brake.linear_deceleration, 0.5);
  EXPECT_EQ(brake.time, 2.0);
  map.set("limits.linear_speed", 0.8);
  EXPECT_EQ(read(map).drive.gate.limits.linear_speed, 0.8);
  map.set("linear.x.has_jerk_limits", true);
  EXPECT_THROW(read(map), ParameterError);
}

TEST(RosControlParameters, ByDefaultThePredictiveOneDrivesAnAssumedJackal) {
  const auto p = read(bare());
  EXPECT_TRUE(std::holds_alternative<PredictiveParameters>(p.drive.controller));
  ASSERT_TRUE(p.drive.plant_model);
  EXPECT_FALSE(p.drive.plant_model->identified);
  ParameterMap map = bare();
  map.set("diff_drive.rate", 50.0);
  EXPECT_TRUE(std::holds_alternative<DifferentialDriveParameters>(read(map).drive.controller));
}

TEST(RosControlParameters, RefusesWhatCannotDrive) {
  EXPECT_EQ(refusal(ParameterMap()), "Couldn't retrieve wheel param 'left_wheel'");
  expectSays(refusal(bare(), ""), {"Robot description"});
  const std::tuple<const char*, ParameterValue, const char*> rows[] = {
      {"left_wheel", std::vector<std::string>{"front_left_wheel", "rear_left_wheel"},
       "#left wheels (2) != #right wheels (1)"},
      {"left_wheel", std::vector<double>{}, "'left_wheel'"},
      {"left_wheel", std::string("no_such_wheel"), "no_such_wheel"},
      {"pose_covariance_diagonal", std::vector<double>{1, 2}, "pose_covariance_diagonal"},
      {"robot.effective_track", 0.5, "wheel_separation"},
      {"predictive.kappa_mu", 1.0, "predictive.kappa_mu"}};
  for (const auto& [key, value, said] : rows) {
    ParameterMap map = bare();
    map.set(key, value);
    expectSays(refusal(map), {said});
  }
}

TEST(RosControlParameters, TellsKeysThatNobodyReads) {
  ParameterMap map = bare();
  map.set("type", std::string("jackal_aic/ActiveInferenceController"));
  map.set("k_l", 0.1);
  map.set("cmd_vel_timout", 0.1);
  EXPECT_EQ(read(map).unused, std::vector<std::string>{"cmd_vel_timout"});
}

}  // namespace
}  // namespace jackal_aic
