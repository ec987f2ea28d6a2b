// Healthy robots under the fault monitor, drawn by seed: ten minutes each. `experiments detection --quiet-hours` has
// hours.

#include "quiet_hours.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace jackal_aic::sim {
namespace {

constexpr std::uint64_t kSeed = 20;
constexpr double kTenMinutes = 600.0;  // s

const PackageFiles& files() {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return files;
}

class QuietDrives : public testing::TestWithParam<int> {};

TEST_P(QuietDrives, RaiseNoAlarm) {
  const auto robots = GetParam() % 3 == 2 ? QuietRobots::unidentified : QuietRobots::identified;
  const QuietDrive drive = drawQuietDrive(kSeed, static_cast<std::uint64_t>(GetParam()), kTenMinutes, robots);
  const Alarms alarms = runQuiet(files(), drive);
  EXPECT_EQ(alarms.fault, "") << describe(drive);
  EXPECT_EQ(alarms.faults, 0u);
  EXPECT_GT(alarms.samples, 29000u);
}

INSTANTIATE_TEST_SUITE_P(DrawnBySeed, QuietDrives, testing::Range(0, 20));

/// On the plant `real`, over patches of friction: arcs, a straight line on unlike tyres, and circles.
class QuietDrivesOnReal : public testing::TestWithParam<int> {};

TEST_P(QuietDrivesOnReal, RaiseNoAlarm) {
  const auto number = static_cast<std::uint64_t>(GetParam());
  const QuietDrive drive = drawQuietDrive(1, number, kTenMinutes, QuietRobots::identified, World::real);
  const Alarms alarms = runQuiet(files(), drive);
  EXPECT_EQ(alarms.fault, "") << describe(drive);
  EXPECT_GT(alarms.samples, 25000u);
}

INSTANTIATE_TEST_SUITE_P(DrawnBySeed, QuietDrivesOnReal, testing::Values(0, 1, 6, 16));

/// The door sill of the plant `real`, which shakes the gyro as the front wheels meet it and again as the rear ones do.
TEST(QuietDrive, ADoorSillIsNoFaultOfTheGyro) {
  for (const char* controller : {"predictive", "improved", "diff_drive"}) {
    for (const double speed : {0.5, 1.0, 1.5}) {
      for (const char* seed : {"1", "3", "4", "6"}) {
        const LoopSetup setup = loadSetup(files(), controller, "real", {{"plant.seed", seed}});
        SetPointProfile profile;
        profile.changes = {{kRestTime, {speed, 0.0, 0.0}}};
        profile.duration = kRestTime + 11.0 / speed;
        AlarmCounter alarms;
        runMonitored(setup, monitorModel(files(), "real"), profile, {},
                     [&alarms](const MonitoredSample& sample) { alarms.add(sample); });
        EXPECT_EQ(alarms.alarms().fault, "") << controller << ", " << speed << " m/s, seed " << seed;
      }
    }
  }
}

/// The kerb of the fault campaign (sim/faults/scenarios.yaml), which turns the robot for a moment, is no slip to learn
/// from.
TEST(QuietDrive, AKerbTeachesNoVeer) {
  for (const double torque : {15.0, -15.0}) {  // N m
    for (const char* seed : {"1", "2", "3"}) {
      const LoopSetup setup = loadSetup(files(), "predictive", "ground", {{"plant.seed", seed}});
      Faults kerb;
      kerb.pushes = {{-200.0, torque, 4.0, 4.12}};
      SetPointProfile profile;
      profile.changes = {{kRestTime, {0.5, 0.0, 0.0}}};
      profile.duration = 8.0;
      AlarmCounter alarms;
      double turned = 0.0;
      int samples = 0;
      runMonitored(setup, monitorModel(files(), "ground"), profile, kerb, [&](const MonitoredSample& sample) {
        alarms.add(sample);
        if (sample.time < 6.0) return;
        turned += sample.yaw_rate;
        ++samples;
      });
      EXPECT_LT(std::abs(turned / samples), 0.01) << "torque " << torque << " N m, seed " << seed;
      EXPECT_EQ(alarms.alarms().fault, "") << "torque " << torque << " N m, seed " << seed;
    }
  }
}

/// A joystick that goes to and fro and then rests, with encoders whose noise is below their resolution.
TEST(QuietDrive, ToAndFroIsNoNoiseOfTheEncoder) {
  const QuietDrive drive = drawQuietDrive(5, 4, 60.0, QuietRobots::identified);
  ASSERT_EQ(drive.motion, "joystick");
  EXPECT_EQ(runQuiet(files(), drive).fault, "") << describe(drive);
}

TEST(QuietDrive, DependsOnSeedAndNumberAlone) {
  const auto line = [](std::uint64_t seed, std::uint64_t number) {
    return describe(drawQuietDrive(seed, number, kTenMinutes, QuietRobots::unidentified));
  };
  EXPECT_EQ(line(1, 3), line(1, 3));
  EXPECT_NE(line(1, 3), line(1, 4));
  EXPECT_NE(line(1, 3), line(2, 3));
}

TEST(QuietDrive, EverythingIsDrawn) {
  std::set<std::string> controllers, plants, motions;
  std::set<std::pair<std::string, std::string>> sensors;
  for (std::uint64_t number = 0; number < 300; ++number) {
    const QuietDrive drive = drawQuietDrive(1, number, kTenMinutes, QuietRobots::identified);
    controllers.insert(drive.controller);
    plants.insert(drive.plant);
    motions.insert(drive.motion.substr(0, drive.motion.find(' ')));
    for (const auto& [key, value] : drive.overrides) {
      if (key != "plant.seed") sensors.emplace(key, value);
    }
    EXPECT_EQ(drive.robot.dead_time, 1.0) << "identified";
  }
  EXPECT_EQ(controllers.size(), controllerNames().size());
  EXPECT_EQ(plants.size(), 2u);
  EXPECT_EQ(motions, (std::set<std::string>{"turn", "circle", "straight", "arcs", "joystick", "stand"}));
  EXPECT_EQ(sensors.size(), 5u + 3u + 2u);
}

TEST(QuietHours, AreWholeDrives) {
  EXPECT_THROW(runQuietHours(files(), 0.3, 1, QuietRobots::identified, 1), ParameterError);
  EXPECT_THROW(runQuietHours(files(), 0.0, 1, QuietRobots::identified, 1), ParameterError);
}

}  // namespace
}  // namespace jackal_aic::sim
