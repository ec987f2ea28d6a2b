// Robots that nobody has identified, driven with what is assumed of them (config/jackal_model.yaml). The campaign over
// all of them, half an hour each, is `experiments unidentified`.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "closed_loop.hpp"
#include "drives.hpp"
#include "jackal_aic/certificate/certificate.hpp"
#include "jackal_aic/config/yaml_parameters.hpp"
#include "loop_setup.hpp"
#include "plant_conversion.hpp"
#include "step_response.hpp"

namespace jackal_aic::sim {
namespace {

TEST(DrivenModel, IsStableOnEveryRobotThatNobodyHasIdentified) {
  const PackageFiles files("");
  ParameterMap map;
  addYamlFile(files.path("config/jackal_model.yaml"), map);
  const auto assumed = readParameters<PlantModel>(map, "plant_model");
  ASSERT_FALSE(assumed.identified);
  ParameterMap preset;
  addYamlFile(files.path("config/predictive.yaml"), preset);
  const auto gains = readParameters<PredictiveParameters>(preset, "predictive");
  for (const double dead_time : {0.5, 1.0, 2.0}) {
    for (const double lag : {0.5, 1.0, 2.0}) {
      for (const double gain : {0.8, 1.0, 1.2}) {
        PlantModel robot = assumed;
        robot.dead_time *= dead_time;
        robot.lag *= lag;
        robot.gain *= gain;
        EXPECT_LT(LinearLoop(gains, drivenModel(assumed), robot).worstSpectralRadius(LoopMode::straight).upper(), 0.98)
            << dead_time << " x dead time, " << lag << " x lag, gain " << gain;
      }
    }
  }
}

constexpr double kJoystick = 20.0;  // s
constexpr double kStepTime = kJoystick + 2.0;

/// Joystick driving, a rest, and a step of the forward speed [m/s] that is assessed.
AssessedProfile stepAfterJoystick(double speed, std::uint64_t seed) {
  AssessedProfile profile{joystickDriving(seed, kJoystick)};
  profile.changes.push_back({kJoystick, SetPoint{}});
  profile.changes.push_back({kStepTime, SetPoint{speed, 0.0, 0.0}});
  profile.assessed_from = kStepTime;
  profile.assessed_until = profile.duration = kStepTime + 4.0;
  return profile;
}

/// A robot driven along it.
struct Driven {
  ResponseMetrics response;
  double limit;  ///< of the acceleration that is asked for in the end [m/s^2]
};

/// Drives a robot with the predictive controller, told a model.
Driven drive(const PlantModel& told, const PlantModel& robot, double speed, std::uint64_t seed) {
  const LimitParameters limits;  // of the drive gate, as on a robot
  LoopSetup setup = loadSetup(PackageFiles(""), "predictive", "ground",
                              {{"limits.linear_acceleration", std::to_string(limits.linear_acceleration)},
                               {"limits.angular_acceleration", std::to_string(limits.angular_acceleration)}});
  setup.drive.plant_model = told;
  setup.plant = simulatedRobot(robot);
  setup.plant.seed = seed;
  JackalPlant plant(setup.urdf, setup.plant);
  DriveLoop loop = makeLoop(setup);
  const AssessedProfile profile = stepAfterJoystick(speed, seed);
  const auto samples = runClosedLoop(plant, loop, profile, Support::ground, setup.drive.geometry);
  return {assess(samples, profile), loop.predictive()->model().acceleration_limit};
}

/// Motors with a lower gain than assumed are no motors at their limit: a belief that takes them for such leaves a wheel
/// below its goal until it notices, one wheel before the other.
TEST(Unidentified, NoWheelHangsBelowItsGoal) {
  struct Case {
    SetPoint set_point;
    double fastest_wheel;  // of the goal [m/s]
  };
  const PlantModel assumed = assumedModel(PackageFiles(""));
  const double asked = drivenModel(assumed).acceleration_limit;
  for (const double gain : {0.9, 1.0}) {
    for (const Case& c : {Case{{1.5, 0.0, 0.0}, 1.5}, Case{{1.0, 0.0, -1.0}, 1.22}, Case{{0.5, 0.0, 0.5}, 0.61}}) {
      for (const std::uint64_t seed : {1, 2, 3}) {
        LoopSetup setup = loadSetup(PackageFiles(""), "predictive", "ground", {});
        setup.drive.plant_model = assumed;
        setup.plant.wheel_gain *= gain;
        setup.plant.seed = seed;
        JackalPlant plant(setup.urdf, setup.plant);
        DriveLoop loop = makeLoop(setup);
        AssessedProfile profile;
        profile.changes = {{1.0, c.set_point}};
        profile.assessed_from = 1.0;
        profile.assessed_until = profile.duration = 6.0;
        const auto samples = runClosedLoop(plant, loop, profile, Support::ground, setup.drive.geometry);
        const ResponseMetrics response = assess(samples, profile);
        ASSERT_TRUE(response.settling) << "gain " << gain << ", " << c.fastest_wheel << " m/s, seed " << seed;
        EXPECT_LT(*response.settling, c.fastest_wheel / asked + 0.65)
            << "gain " << gain << ", " << c.fastest_wheel << " m/s, seed " << seed;
      }
    }
  }
}

PlantModel identified(PlantModel robot) {
  robot.identified = true;
  return robot;
}

/// What the wheels followed can be followed: a robot that is faster than assumed does not stay slow.
TEST(OpeningLimit, AfterJoystickDrivingAFastRobotIsAboutAsFastAsIdentified) {
  const PlantModel assumed = assumedModel(PackageFiles(""));
  PlantModel gazebo = assumed;  // config/gazebo_model.yaml
  gazebo.dead_time = 0.006;
  gazebo.lag = 0.01;
  gazebo.acceleration_limit = 16.0;
  for (const double speed : {0.5, 1.0}) {
    for (const std::uint64_t seed : {1, 2, 3}) {
      const Driven known = drive(identified(gazebo), gazebo, speed, seed), opened = drive(assumed, gazebo, speed, seed);
      ASSERT_TRUE(known.response.settling && opened.response.settling);
      EXPECT_LE(*opened.response.settling, 1.25 * *known.response.settling + 0.05) << speed << " m/s, seed " << seed;
      EXPECT_LE(opened.response.overshoot_pct, 5.0) << speed << " m/s, seed " << seed;
      EXPECT_GT(opened.limit, 3.0);
      EXPECT_EQ(known.limit, 16.0) << "an identified limit stays";
    }
  }
}

/// Motors that do not follow are not asked for more.
TEST(OpeningLimit, ItOpensNoFurtherThanTheMotorsFollow) {
  const PlantModel assumed = assumedModel(PackageFiles(""));
  for (const double share : {0.5, 1.0, 3.0}) {
    PlantModel robot = assumed;
    robot.acceleration_limit *= share;
    for (const std::uint64_t seed : {1, 2, 3}) {
      const Driven opened = drive(assumed, robot, 1.0, seed);
      EXPECT_NEAR(opened.limit, robot.acceleration_limit, 0.1 * robot.acceleration_limit) << "seed " << seed;
      EXPECT_LE(opened.response.overshoot_pct, 5.0) << "seed " << seed;
    }
  }
}

}  // namespace
}  // namespace jackal_aic::sim
