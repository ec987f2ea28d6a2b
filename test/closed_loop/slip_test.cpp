// Slip learning on the rigid bodies of the simulated robot, whose skid-steer slip comes out of its contacts.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "closed_loop.hpp"
#include "drives.hpp"
#include "loop_setup.hpp"
#include "predictive_loop.hpp"
#include "step_response.hpp"

namespace jackal_aic::sim {
namespace {

/// A controller whose effective track is off by a factor.
GeometryParameters trackOff(double factor) {
  constexpr double kTrueTrack = 0.547;  // of the simulated robot turning in place (config/plant_model.yaml) [m]
  GeometryParameters geometry;
  geometry.effective_track = kTrueTrack / factor;
  return geometry;
}

const SetPoint kTurns[] = {{0.0, 0.0, 0.2}, {0.0, 0.0, 0.5}, {0.0, 0.0, -0.5}, {0.0, 0.0, 1.0}, {0.5, 0.0, 0.5}};

TEST(Slip, WrongTrackIsLearnedWithinThreeSecondsOfATurn) {
  for (const double factor : {0.75, 1.0, 1.25}) {
    for (const SetPoint& turn : kTurns) {
      PredictiveLoop loop(trackOff(factor));
      loop.drive({}, 0.5);
      const Motion motion = loop.drive(turn, 3.0);
      EXPECT_NEAR(motion.yaw_rate, turn.yaw_rate, 0.02 * std::abs(turn.yaw_rate)) << factor << ", " << turn.forward;
      EXPECT_NEAR(motion.forward, turn.forward, 0.01) << factor << ", " << turn.yaw_rate;
    }
  }
  PredictiveLoop wrong(trackOff(1.25)), right;
  wrong.drive({}, 0.5);
  right.drive({}, 0.5);
  EXPECT_NEAR(wrong.drive({0.5, 0.0, 0.0}, 3.0).forward, right.drive({0.5, 0.0, 0.0}, 3.0).forward, 1e-6) << "straight";
}

TEST(Slip, ChangeOfFrictionIsLearnedWithinThreeSeconds) {
  for (double friction : {0.25, 1.0}) {
    for (const SetPoint& turn : {kTurns[1], kTurns[4]}) {
      PredictiveLoop loop;
      loop.drive({}, 0.5);
      loop.drive(turn, 3.0);
      loop.setFriction(friction);
      EXPECT_NEAR(loop.drive(turn, 3.0).yaw_rate, turn.yaw_rate, 0.02 * turn.yaw_rate) << "friction " << friction;
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

TEST_P(CoarseEncoders, TenMinutesStraightTeachNoTurn) {
  PredictiveLoop loop({}, PredictiveLoop::preset(), robot());
  loop.drive({}, 0.5);
  loop.drive({0.3, 0.0, 0.5}, 3.0);
  loop.drive({}, 1.0);
  const double track = loop.controller.effectiveTrack();
  loop.drive({GetParam().speed, 0.0, 0.0}, 600.0);
  EXPECT_NEAR(loop.controller.effectiveTrack(), track, 0.01 * track);
}

INSTANTIATE_TEST_SUITE_P(AtSpeeds, CoarseEncoders,
                         testing::Values(Encoders{0.06, 0.03, 0.5}, Encoders{0.3, 0.03, 0.1}, Encoders{0.3, 0.03, 1.5},
                                         Encoders{0.153, 0.15, 0.5}));

TEST(Slip, TurnInPlaceAfterJoystickDrivingSettlesAtOnce) {
  constexpr double kDrive = 60.0, kStep = kDrive + 3.0;  // s
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6}) {
    LoopSetup setup = loadSetup(files(), "predictive", "ground", {});
    setup.plant.seed = seed;
    AssessedProfile profile{joystickDriving(seed, kDrive)};
    profile.changes.push_back({kDrive, SetPoint{}});
    profile.changes.push_back({kStep, SetPoint{0.0, 0.0, 0.8}});
    profile.assessed = kYaw;
    profile.assessed_from = kStep;
    profile.assessed_until = profile.duration = kStep + 4.0;
    JackalPlant plant(setup.urdf, setup.plant);
    DriveLoop loop = makeLoop(setup);
    const ResponseMetrics response =
        assess(runClosedLoop(plant, loop, profile, Support::ground, setup.drive.geometry), profile);
    ASSERT_TRUE(response.settling) << "seed " << seed;
    EXPECT_LE(*response.settling, 0.3) << "seed " << seed;
  }
}

/// On a ramp of 12 degrees a turn slides the robot sideways: its wheels keep their range, and a fault is reported.
TEST(Slip, TurnOnARampIsBoundedAndReported) {
  constexpr double kRate = 0.8, kMost = 1.5;  // rad/s; of the wheel speeds on level ground
  for (const char* preset : {"predictive", "improved"}) {
    for (const double friction : {0.5, 0.3}) {
      LoopSetup setup = loadSetup(files(), preset, "ground", {});
      const PlantModel model = monitorModel(files(), "ground");
      setup.drive.plant_model = model;
      setup.plant.slope = 12.0;
      setup.plant.friction = friction;
      SetPointProfile profile;
      profile.changes = {{2.0, {0.0, 0.0, kRate}}};
      profile.duration = 10.0;
      double fastest = 0.0;
      bool reported = false;
      for (const MonitoredSample& sample : runMonitored(setup, model, profile, {})) {
        fastest = std::max(fastest, std::abs(sample.command.left));
        reported = reported || sample.fault != Fault::none;
      }
      const double asked = 0.5 * kRate * setup.drive.geometry.effective_track / setup.drive.geometry.wheel_radius;
      EXPECT_LE(fastest, kMost * asked + 0.5) << preset << ", friction " << friction;
      EXPECT_EQ(reported, friction < 0.5) << preset << ", friction " << friction;
    }
  }
}

}  // namespace
}  // namespace jackal_aic::sim
