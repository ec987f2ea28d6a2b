// Slip learning on the rigid bodies of the simulated robot, whose skid-steer slip comes out of its contacts.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "closed_loop.hpp"
#include "drives.hpp"
#include "loop_setup.hpp"
#include "monitored_loop.hpp"
#include "predictive_loop.hpp"
#include "step_response.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kTrueTrack = 0.547;  // of the simulated robot turning in place (config/plant_model.yaml) [m]

GeometryParameters trackOff(double factor) {
  GeometryParameters geometry;
  geometry.effective_track = kTrueTrack / factor;
  return geometry;
}

struct Turn {
  double forward;
  double yaw_rate;
};

class WrongTrack : public testing::TestWithParam<std::tuple<double, Turn>> {};

TEST_P(WrongTrack, YawRateIsRightWithinThreeSeconds) {
  const auto [factor, turn] = GetParam();
  PredictiveLoop loop(trackOff(factor));
  loop.drive({}, 0.5);
  const Motion motion = loop.drive({turn.forward, 0.0, turn.yaw_rate}, 3.0);
  EXPECT_NEAR(motion.yaw_rate, turn.yaw_rate, 0.02 * std::abs(turn.yaw_rate));
  EXPECT_NEAR(motion.forward, turn.forward, 0.01);
}

INSTANTIATE_TEST_SUITE_P(Turns, WrongTrack,
                         testing::Combine(testing::Values(0.75, 1.0, 1.25),
                                          testing::Values(Turn{0.0, 0.2}, Turn{0.0, 0.5}, Turn{0.0, -0.5},
                                                          Turn{0.0, 1.0}, Turn{0.5, 0.5})));

TEST(Slip, YawRateIsRightAgainAfterAChangeOfFriction) {
  for (double friction : {0.25, 1.0}) {
    for (const Turn turn : {Turn{0.0, 0.5}, Turn{0.5, 0.5}}) {
      PredictiveLoop loop;
      loop.drive({}, 0.5);
      loop.drive({turn.forward, 0.0, turn.yaw_rate}, 3.0);
      loop.setFriction(friction);
      const Motion motion = loop.drive({turn.forward, 0.0, turn.yaw_rate}, 3.0);
      EXPECT_NEAR(motion.yaw_rate, turn.yaw_rate, 0.02 * turn.yaw_rate) << "friction " << friction;
    }
  }
}

/// Resolution and noise of the encoders [rad/s], and a speed [m/s].
struct Encoders {
  double step;
  double noise;
  double speed;
};

class CoarseEncoders : public testing::TestWithParam<Encoders> {
 protected:
  static PlantParameters robot() {
    PlantParameters robot = PredictiveLoop::ground();
    robot.encoder_step = GetParam().step;
    robot.encoder_noise = GetParam().noise;
    return robot;
  }
};

TEST_P(CoarseEncoders, AreNotTakenForATurnInTenMinutesOfDrivingStraight) {
  PredictiveLoop loop({}, PredictiveLoop::preset(), robot());
  loop.drive({}, 0.5);
  loop.drive({0.3, 0.0, 0.5}, 3.0);
  loop.drive({}, 1.0);
  const double track = loop.controller.effectiveTrack();
  loop.drive({GetParam().speed, 0.0, 0.0}, 600.0);
  EXPECT_NEAR(loop.controller.effectiveTrack(), track, 0.01 * track);
}

TEST_P(CoarseEncoders, HideNoWrongTrackFromATurn) {
  for (const double factor : {0.75, 1.25}) {
    PredictiveLoop loop(trackOff(factor), PredictiveLoop::preset(), robot());
    loop.drive({}, 0.5);
    const Motion motion = loop.drive({0.5 * GetParam().speed, 0.0, 0.5}, 3.0);
    EXPECT_NEAR(motion.yaw_rate, 0.5, 0.03 * 0.5) << factor;
  }
}

INSTANTIATE_TEST_SUITE_P(AtSpeeds, CoarseEncoders,
                         testing::Values(Encoders{0.06, 0.03, 0.5}, Encoders{0.3, 0.03, 0.1}, Encoders{0.3, 0.03, 1.5},
                                         Encoders{0.153, 0.15, 0.5}));

TEST(Slip, AWrongTrackLeavesTheStraightLineAlone) {
  PredictiveLoop wrong(trackOff(1.25)), right;
  wrong.drive({}, 0.5);
  right.drive({}, 0.5);
  EXPECT_NEAR(wrong.drive({0.5, 0.0, 0.0}, 3.0).forward, right.drive({0.5, 0.0, 0.0}, 3.0).forward, 1e-6);
}

/// What an arc taught about the ground does not spoil a turn in place some seconds later.
TEST(Slip, ATurnAfterJoystickDrivingIsAsFastAsTheFirst) {
  constexpr double kDrive = 60.0, kStep = kDrive + 3.0;  // s
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6}) {
    LoopSetup setup = loadSetup(PackageFiles(""), "predictive", "ground", {});
    setup.plant.seed = seed;
    AssessedProfile profile{joystickDriving(seed, kDrive)};
    profile.changes.push_back({kDrive, SetPoint{}});
    profile.changes.push_back({kStep, SetPoint{0.0, 0.0, 0.8}});
    profile.assessed = kYaw;
    profile.assessed_from = kStep;
    profile.assessed_until = profile.duration = kStep + 4.0;
    JackalPlant plant(setup.urdf, setup.plant);
    DriveLoop loop = makeLoop(setup);
    const auto samples = runClosedLoop(plant, loop, profile, Support::ground, setup.drive.geometry);
    const ResponseMetrics response = assess(samples, profile);
    ASSERT_TRUE(response.settling) << "seed " << seed;
    EXPECT_LE(*response.settling, 0.3) << "seed " << seed;
  }
}

/// On a ramp of 12 degrees a turn slides the robot sideways: its wheels stay within the range, and it is told.
TEST(Slip, ATurnOnARampIsBoundedAndTold) {
  constexpr double kRate = 0.8, kMost = 1.5;  // rad/s; of what the wheels are told on level ground
  for (const char* preset : {"predictive", "improved"}) {
    for (const double friction : {0.5, 0.3}) {
      LoopSetup setup = loadSetup(PackageFiles(""), preset, "ground", {});
      const PlantModel model = monitorModel(PackageFiles(""), "ground");
      setup.drive.plant_model = model;
      setup.plant.slope = 12.0;
      setup.plant.friction = friction;
      SetPointProfile profile;
      profile.changes = {{2.0, {0.0, 0.0, kRate}}};
      profile.duration = 10.0;
      double fastest = 0.0;
      bool told = false;
      for (const MonitoredSample& sample : runMonitored(setup, model, profile, {})) {
        fastest = std::max(fastest, std::abs(sample.command.left));
        told = told || sample.fault != Fault::none;
      }
      const double asked = 0.5 * kRate * setup.drive.geometry.effective_track / setup.drive.geometry.wheel_radius;
      EXPECT_LE(fastest, kMost * asked + 0.5) << preset << ", friction " << friction;
      EXPECT_EQ(told, friction < 0.5) << preset << ", friction " << friction;
    }
  }
}

}  // namespace
}  // namespace jackal_aic::sim
