#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <random>

#include "jackal_aic/faults/fault_monitor.hpp"
#include "jackal_aic/model/gravity.hpp"
#include "jackal_aic/model/wheel_belief.hpp"

/// @file
/// Which of the robot's sensors and drives is found faulty, and what the monitor makes of pushes, kerbs, lost
/// channels and restarts.

namespace jackal_aic {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kRadius = 0.098;               // m
constexpr double kTrack = 0.55;                 // m
constexpr double kPerWheel = kRadius / kTrack;  // yaw rate by difference of the wheels
constexpr WheelCommand kStand{}, kStraight{5.0, 5.0}, kFast{10.0, 10.0};

PlantModel model() {
  PlantModel m;
  m.dead_time = 0.08;
  m.lag = 0.01;
  m.acceleration_limit = 1.65;
  m.effective_track = kTrack;
  return m;
}

/// A model that leaves nothing open, and the parameters for it.
PlantModel exactModel() {
  PlantModel m = model();
  m.identified = true;
  return m;
}

/// One of a robot that turns half as fast.
PlantModel wideModel() {
  PlantModel m = exactModel();
  m.effective_track = 2.0 * kTrack;
  return m;
}

FaultParameters exactParameters() {
  FaultParameters p;
  p.dead_time_deviation = 0.0;
  p.slowest_acceleration = p.fastest_acceleration = 1.0;
  return p;
}

/// A robot, and its monitor.
class Robot {
 public:
  explicit Robot(const FaultParameters& parameters = {}, const PlantModel& told = model(),
                 const GeometryParameters& geometry = {})
      : Robot(parameters, told, told, geometry) {}

  Robot(const FaultParameters& parameters, const PlantModel& told, const PlantModel& real,
        const GeometryParameters& geometry = {})
      : monitor(parameters, geometry, told), geometry_(geometry), left_(real, kRadius, {}), right_(left_) {}

  /// Drives for some samples. @param command empty if it is unknown; @param fault changes the samples.
  template <class Fault>
  const FaultReport& drive(const WheelCommand& command, int samples, Fault fault) {
    for (; samples > 0; --samples) {
      pass(command, 0.02);
      Observation y = sample();
      fault(y);
      monitor.check(y);
    }
    return monitor.report();
  }

  const FaultReport& drive(const WheelCommand& command, int samples) {
    return drive(command, samples, [](Observation&) {});
  }

  /// Lets time pass [s].
  void pass(const WheelCommand& command, double duration) {
    for (long k = std::lround(duration / 0.001); k > 0; --k) {
      time_ += 0.001;
      monitor.advance(known ? std::optional(command) : std::nullopt, 0.001);
      left_.predict(command.left);
      right_.predict(command.right);
    }
  }

  /// A sample now.
  Observation sample() {
    Observation y;
    y.stamp = time_;
    y.wheel_left = left_.speed() + noise * 0.03 * normal_(random_);
    y.wheel_right = right_.speed() + noise * 0.03 * normal_(random_);
    const double radius = kRadius * geometry_.slip_factor;
    y.yaw_rate = radius * (right_.speed() - left_.speed()) / kTrack + noise * 0.005 * normal_(random_);
    y.acceleration_x = radius * 0.5 * (left_.acceleration() + right_.acceleration()) + noise * 0.05 * normal_(random_);
    y.acceleration_z = kGravity + noise * 0.05 * normal_(random_);
    return y;
  }

  FaultMonitor monitor;
  double noise = 1.0;  // in multiples of the usual one
  bool known = true;   // the commands

 private:
  GeometryParameters geometry_;
  WheelBelief left_;
  WheelBelief right_;
  double time_ = 0.0;
  std::mt19937 random_{5};
  std::normal_distribution<double> normal_{0.0, 1.0};
};

/// One without noise, that drives straight and is known.
Robot settled(const WheelCommand& command = kStraight, const FaultParameters& parameters = {},
              const PlantModel& told = model()) {
  Robot robot(parameters, told);
  robot.noise = 0.0;
  robot.drive(command, 300);
  return robot;
}

/// Exchanges the sides.
Observation mirrored(Observation y) {
  std::swap(y.wheel_left, y.wheel_right);
  std::swap(y.valid.wheel_left, y.valid.wheel_right);
  y.yaw_rate = -y.yaw_rate;
  return y;
}

/// Left wheel off its prediction, and the part of the turn that this would make which the gyro sees.
struct Off {
  double speed, part, turn = 1.0;  // of that of a narrower robot
  void operator()(Observation& y) const {
    y.wheel_left += speed;
    y.yaw_rate -= part * turn * kPerWheel * speed;
  }
};

TEST(FaultIsolation, TheGyroTellsAnEncoderFromADriveIfOneErrorIsTwiceTheOtherSquared) {
  // (1 - part)^2 against 2 part^2: from 0.414 on it agrees with the encoder.
  EXPECT_EQ(settled().drive(kStraight, 15, Off{-5.0, 0.38}).fault(), Fault::left_encoder_wrong);
  EXPECT_EQ(settled().drive(kStraight, 15, Off{-5.0, 0.46}).fault(), Fault::left_wheels_blocked);
}

TEST(FaultIsolation, ASmallErrorOfTheYawRateIsNoEvidence) {
  // The squares of three samples are summed up, with a memory of 0.05 s.
  Robot slower = settled(kStraight, {}, wideModel());
  const FaultReport& report = slower.drive(kStraight, 100, Off{-0.5, 0.4, 0.5});
  EXPECT_EQ(report.fault(), Fault::none) << "it turns on";
  EXPECT_TRUE(report.valid().wheel_left);
  EXPECT_EQ(settled(kStraight, {}, wideModel()).drive(kStraight, 15, Off{-0.55, 0.25, 0.5}).fault(),
            Fault::left_encoder_wrong);
}

TEST(FaultIsolation, NothingIsToldBeforeTheBodyHadTimeToTurn) {
  for (const double part : {0.0, 1.0}) {
    EXPECT_EQ(settled().drive(kStraight, 8, Off{-5.0, part}).fault(), Fault::none);
    EXPECT_NE(settled().drive(kStraight, 13, Off{-5.0, part}).fault(), Fault::none);
  }
}

TEST(FaultIsolation, AWheelThatIsDraggedAlongIsGivenSixTenthsOfASecondUnlessTheGyroIsSureOfItsEncoder) {
  EXPECT_EQ(settled().drive(kStraight, 25, Off{2.0, 1.0}).fault(), Fault::none);
  EXPECT_EQ(settled().drive(kStraight, 35, Off{2.0, 1.0}).fault(), Fault::left_wheels_blocked);
  EXPECT_EQ(settled().drive(kStraight, 25, Off{2.0, 0.0}).fault(), Fault::left_encoder_wrong) << "nothing turns";
  Robot wide = settled(kStraight, {}, wideModel());
  EXPECT_EQ(wide.drive(kStraight, 18, Off{0.6, 0.45, 0.5}).fault(), Fault::none) << "no evidence for either";
  EXPECT_EQ(settled().drive(kStraight, 25, Off{2.0, 0.35}).fault(), Fault::none) << "neither explains it";
  EXPECT_EQ(settled().drive(kStraight, 35, Off{2.0, 0.35}).fault(), Fault::left_encoder_wrong);
}

TEST(FaultIsolation, AGyroThatIsNoWitnessLeavesTheDrive) {
  const auto with = [](auto before, auto fault, const PlantModel& told) {
    Robot robot = settled(kStraight, {}, told);
    robot.drive(kStraight, 40, before);
    return robot.drive(kStraight, 15, [&](Observation& y) {
      before(y);
      fault(y);
    });
  };
  const auto nothing = [](Observation&) {};
  const auto stops = [](Observation& y) { y.wheel_left = 0.0; };
  EXPECT_EQ(with(nothing, stops, model()).fault(), Fault::left_encoder_wrong) << "the gyro sees no turn";
  EXPECT_TRUE(with([](Observation& y) { y.valid.yaw_rate = false; }, stops, model()).drive_left);
  EXPECT_TRUE(
      with([](Observation& y) { y.yaw_rate += 1.0; }, [](Observation& y) { y.wheel_left = y.yaw_rate = 0.0; }, model())
          .drive_left)
      << "it was found faulty";
  EXPECT_TRUE(with([](Observation& y) { y.acceleration_x += 20.0; }, stops, model()).drive_left)
      << "the accelerometer of the same IMU was";
  EXPECT_TRUE(with([](Observation& y) { y.valid.wheel_right = false; }, stops, model()).drive_left)
      << "the other wheel is not measured";
  PlantModel box = model();
  box.on_box = true;
  EXPECT_TRUE(with(nothing, stops, box).drive_left);
}

TEST(FaultIsolation, WhatWasToldStaysWhenTheWitnessIsLost) {
  Robot robot = settled();
  robot.drive(kStraight, 15, Off{-5.0, 0.0});
  const FaultReport& later = robot.drive(kStraight, 15, [](Observation& y) {
    y.wheel_left = 0.0;
    y.valid.yaw_rate = false;
  });
  EXPECT_EQ(later.fault(), Fault::left_encoder_wrong);
}

TEST(FaultIsolation, ADriveAndAnEncoderCountAgainAfterASecond) {
  for (const double part : {0.0, 1.0}) {
    Robot robot = settled();
    ASSERT_TRUE(robot.drive(kStraight, 15, Off{-5.0, part}).faulty());
    EXPECT_TRUE(robot.drive(kStraight, 40).faulty());
    EXPECT_FALSE(robot.drive(kStraight, 15).faulty());
    EXPECT_FALSE(robot.monitor.report().drive_left);
    EXPECT_EQ(robot.monitor.report().wheel_left.cause, FaultCause::none);
  }
}

TEST(FaultIsolation, SpikesOfAnEncoderAreAFaultIfTheyComeOften) {
  struct Case {
    int every, samples;
    Fault fault;
  };
  for (const Case& c : {Case{3, 25, Fault::left_encoder_wrong}, Case{50, 1000, Fault::none}}) {
    Robot robot(exactParameters(), exactModel());
    robot.drive(kStraight, 300);
    int sample = 0;
    robot.drive(kStraight, c.samples, [&](Observation& y) { y.wheel_left += ++sample % c.every == 0 ? 3.0 : 0.0; });
    EXPECT_EQ(robot.monitor.report().fault(), c.fault) << "one in " << c.every << " samples";
  }
}

TEST(FaultIsolation, TwoKerbsAreNotOne) {
  for (const bool left : {true, false}) {
    Robot robot = settled();
    const auto kerb = [left](Observation& y) {
      Off{-5.0, 1.0}(y);
      if (!left) y = mirrored(y);
    };
    for (int k = 0; k < 3; ++k) {
      EXPECT_FALSE(robot.drive(kStraight, 7, kerb).faulty()) << k;
      EXPECT_TRUE(robot.drive(kStraight, 20).valid().all());
    }
  }
}

TEST(FaultIsolation, AWheelThatWasHeldUpIsLearnedOfAgainAsSoonAsItFollows) {
  for (const bool left : {true, false}) {
    Robot robot = settled(kStraight, exactParameters(), exactModel());
    const auto off = [left](double speed) {
      return [=](Observation& y) {
        Off{speed, 1.0}(y);
        if (!left) y = mirrored(y);
      };
    };
    const auto distance = [&] {
      const FaultReport& report = robot.monitor.report();
      return (left ? report.wheel_left : report.wheel_right).distance;
    };
    robot.drive(kStraight, 7, off(-4.0));
    robot.drive(kStraight, 1, off(-0.1));
    const double at_first = distance();
    EXPECT_GT(at_first, 0.1);
    robot.drive(kStraight, 16, off(-0.1));
    EXPECT_LT(distance(), 0.5 * at_first);
  }
}

TEST(FaultIsolation, AGyroThatComesBackWhileAWheelIsSuspectIsAWitnessFromThenOn) {
  Robot robot = settled();
  robot.drive(kStraight, 5, [](Observation& y) {
    Off{-5.0, 1.0}(y);
    y.valid.yaw_rate = false;
    y.yaw_rate = kNan;
  });
  EXPECT_EQ(robot.drive(kStraight, 10, Off{-5.0, 1.0}).fault(), Fault::left_wheels_blocked);
}

TEST(FaultIsolation, AGoodSampleNowAndThenDoesNotClearAWheel) {
  Robot robot = settled();
  int k = 0;
  robot.drive(kStraight, 25, [&k](Observation& y) {
    if (k++ % 4 != 3) Off{-5.0, 1.0}(y);
  });
  EXPECT_TRUE(robot.monitor.report().drive_left);
}

TEST(FaultIsolation, AWheelThatWasHeldUpAndIsOnItsWayAgainIsNoFaultAndCounts) {
  for (const bool left : {true, false}) {
    Robot robot = settled();
    double speed = 0.0;
    const auto held = [&](Observation& y) {
      Off{speed - y.wheel_left, 1.0}(y);
      if (!left) y = mirrored(y);
    };
    const auto encoder = [&] { return left ? robot.monitor.report().wheel_left : robot.monitor.report().wheel_right; };
    robot.drive(kStraight, 7, held);
    EXPECT_EQ(encoder().state, ChannelState::outlier);
    for (speed = 0.16; speed < 5.0; speed += 0.16) {  // 8 rad/s^2
      EXPECT_FALSE(robot.drive(kStraight, 1, held).faulty()) << speed;
      if (speed < 0.2) continue;
      EXPECT_EQ(encoder().state, ChannelState::ok) << speed;
    }
  }
}

TEST(FaultIsolation, TheGyroIsNotJudgedByAWheelThatIsSuspect) {
  for (const bool left : {true, false}) {
    Robot robot = settled();
    const double before = robot.monitor.report().gyro.probability;
    const FaultReport& report = robot.drive(kStraight, 1, [&](Observation& y) {
      (left ? y.wheel_left : y.wheel_right) += 10.0;
      y.yaw_rate += 0.5;
    });
    EXPECT_EQ((left ? report.wheel_left : report.wheel_right).state, ChannelState::outlier);
    EXPECT_EQ(report.gyro.state, ChannelState::ok);
    EXPECT_NEAR(report.gyro.probability, before, 1e-4);
  }
}

TEST(FaultIsolation, TheGyroIsJudgedByTheOtherWheelOnceAnEncoderIsFaulty) {
  for (const bool left : {true, false}) {
    Robot robot = settled();
    const auto wrong = [left](Observation& y) { (left ? y.wheel_left : y.wheel_right) -= 3.0; };
    ASSERT_TRUE(robot.drive(kStraight, 15, wrong).faulty());
    EXPECT_EQ(robot.monitor.report().gyro.state, ChannelState::ok);
    const FaultReport& report = robot.drive(kStraight, 20, [&](Observation& y) {
      wrong(y);
      y.yaw_rate += 0.5;
    });
    EXPECT_EQ(report.gyro.state, ChannelState::faulty);
  }
}

TEST(FaultIsolation, ChannelsThatWereLostAreJudgedAgain) {
  const auto after = [](auto fault) {
    Robot robot = settled();
    robot.drive(kStraight, 50, [](Observation& y) {
      y.valid = {false, true, true, false};
      y.yaw_rate = y.acceleration_x = kNan;
    });
    EXPECT_TRUE(robot.drive(kStraight, 5).valid().all());
    return robot.drive(kStraight, 20, fault).fault();
  };
  EXPECT_EQ(after([](Observation& y) { y.yaw_rate += 0.2; }), Fault::gyro_disagrees);
  EXPECT_EQ(after([](Observation& y) { y.acceleration_x += 12.0; }), Fault::accelerometer_disagrees);
}

TEST(FaultIsolation, AChannelThatIsNotMeasuredKeepsItsVerdict) {
  Robot robot = settled();
  robot.drive(kStraight, 20, [](Observation& y) { y.yaw_rate += 0.3, y.acceleration_x += 20.0; });
  const FaultReport& lost = robot.drive(kStraight, 100, [](Observation& y) { y.valid = {false, true, true, false}; });
  EXPECT_EQ(lost.gyro.state, ChannelState::faulty);
  EXPECT_EQ(lost.accelerometer.state, ChannelState::faulty);
}

TEST(FaultIsolation, AnImuUpsideDownHasNoGyroEither) {
  Robot robot = settled();
  const FaultReport& report = robot.drive(kStraight, 20, [](Observation& y) { y.acceleration_z = -kGravity; });
  EXPECT_EQ(report.gyro.state, ChannelState::faulty);
  EXPECT_EQ(report.gyro.cause, FaultCause::gravity);
  EXPECT_EQ(report.accelerometer.cause, FaultCause::gravity);
}

TEST(FaultIsolation, WhatCountsHasNoCause) {
  Robot robot = settled();
  robot.drive(kStraight, 1, [](Observation& y) { y.yaw_rate += 0.3, y.acceleration_x += 20.0; });
  EXPECT_EQ(robot.monitor.report().accelerometer.cause, FaultCause::none);
  EXPECT_EQ(robot.monitor.report().gyro.cause, FaultCause::none);
}

TEST(FaultIsolation, AGyroThatFreezesOnABoxIsFound) {
  PlantModel box = model();
  box.on_box = true;
  Robot robot({}, box);
  const auto stands = [](Observation& y) {
    y.yaw_rate = 0.003 * std::sin(1e4 * y.stamp), y.acceleration_x = 0.01 * std::sin(1e4 * y.stamp);
  };
  EXPECT_FALSE(robot.drive(kStraight, 300, stands).faulty());
  EXPECT_EQ(robot
                .drive(kStraight, 30,
                       [&](Observation& y) {
                         stands(y);
                         y.yaw_rate = 0.001;
                       })
                .fault(),
            Fault::gyro_frozen);
}

TEST(FaultIsolation, TheInclinationOfABoxMayChange) {
  PlantModel box = model();
  box.on_box = true;
  Robot robot({}, box);
  double inclined = 0.0;
  const auto tilts = [&](Observation& y) { y.yaw_rate = 0.0, y.acceleration_x = inclined; };
  robot.drive(kStand, 1000, tilts);
  for (; inclined < 2.0; inclined += 0.01) {
    EXPECT_LT(robot.drive(kStand, 1, tilts).accelerometer.distance, 0.5) << inclined;
  }
}

TEST(FaultIsolation, AGyroThatIsSilentAtRestAndNoisyInAPivotIsNotFrozen) {
  for (const WheelCommand& pivot : {WheelCommand{0.0, 5.0}, WheelCommand{5.0, 0.0}}) {
    Robot robot;
    const auto silent = [](Observation& y) { y.yaw_rate = 0.0; };
    robot.drive(pivot, 6, silent);  // until it moves
    robot.drive(pivot, 300);
    robot.drive(kStand, 20);  // until it stands
    for (int k = 0; k < 100; ++k) ASSERT_FALSE(robot.drive(kStand, 1, silent).faulty()) << k;
  }
}

/// Left encoder repeats every value, so that less is known of it than of the right one.
TEST(FaultIsolation, EncodersThatFreezeTogetherAreFoundTogether) {
  for (const bool left : {true, false}) {
    Robot robot;
    double last = 0.0;
    bool repeats = false;
    robot.drive(kStraight, 100);
    robot.drive({5.0, 5.1}, 100, [&](Observation& y) {
      double& value = left ? y.wheel_left : y.wheel_right;
      if (repeats) value = last;
      last = value;
      repeats = !repeats;
    });
    for (int k = 0; k < 20; ++k) {
      const FaultReport& report =
          robot.drive({5.0, 5.1}, 1, [](Observation& y) { y.wheel_left = 5.01, y.wheel_right = 5.12; });
      ASSERT_EQ(report.wheel_left.cause, report.wheel_right.cause) << k;
    }
    EXPECT_EQ(robot.monitor.report().wheel_left.cause, FaultCause::frozen);
  }
}

// Pushes.

TEST(FaultIsolation, OneWheelThatIsTurnedByHandMovesTheRobot) {
  for (const bool left : {true, false}) {
    Robot robot = settled(kStand);
    const auto push = [left](Observation& y) { (left ? y.wheel_left : y.wheel_right) += 3.0; };
    const FaultReport& pushed = robot.drive(kStand, 10, push);
    EXPECT_EQ(pushed.fault(), Fault::moved);
    EXPECT_FALSE(pushed.valid().wheel_left || pushed.valid().wheel_right) << "the controller does not fight it";
    const WheelCommand fights{left ? -4.0 : 0.0, left ? 0.0 : -4.0};
    EXPECT_EQ(robot.drive(fights, 10, push).fault(), Fault::moved) << "after the controller began to fight it";
    robot.drive(kStand, 60);
    EXPECT_TRUE(robot.monitor.report().valid().all());
    EXPECT_FALSE(robot.monitor.report().moved);
  }
}

TEST(FaultIsolation, AfterAPushTheWheelsAreLearnedOfAgain) {
  for (const bool left : {true, false}) {
    Robot robot = settled(kStand, exactParameters(), exactModel());
    robot.drive(kStand, 20, [](Observation& y) { y.wheel_left += 3.0, y.wheel_right += 3.0; });
    ASSERT_TRUE(robot.monitor.report().moved);
    const auto creeps = [left](Observation& y) { (left ? y.wheel_left : y.wheel_right) += 0.1; };
    const auto distance = [&] {
      const FaultReport& report = robot.monitor.report();
      return (left ? report.wheel_left : report.wheel_right).distance;
    };
    while (robot.drive(kStand, 1, creeps).moved) {
    }
    const double at_first = distance();
    robot.drive(kStand, 25, creeps);
    EXPECT_LT(distance(), 0.5 * at_first);
  }
}

TEST(FaultIsolation, AFaultThatFollowsAPushHasItsOwnTime) {
  Robot robot = settled(kStand, exactParameters(), exactModel());
  robot.drive(kStand, 20, [](Observation& y) { y.wheel_left += 3.0, y.wheel_right += 3.0; });
  int samples = 0;
  while (robot.drive(kStraight, 1).moved && samples < 20) ++samples;
  ASSERT_EQ(samples, 7);
  EXPECT_FALSE(robot.drive(kStraight, 7, Off{-3.0, 1.0}).faulty()) << "0.14 s";
  EXPECT_TRUE(robot.drive(kStraight, 40, Off{-3.0, 1.0}).faulty());
}

TEST(FaultIsolation, AWheelThatTurnsWhileTheOtherIsToTurnIsNotPushed) {
  for (const bool left : {true, false}) {
    const WheelCommand command{left ? 0.0 : 5.0, left ? 5.0 : 0.0};
    Robot robot = settled(command);
    for (int k = 0; k < 50; ++k) {
      EXPECT_FALSE(
          robot.drive(command, 1, [left](Observation& y) { (left ? y.wheel_left : y.wheel_right) += 3.0; }).moved);
    }
    EXPECT_TRUE(robot.monitor.report().faulty());
  }
}

TEST(FaultIsolation, AFaultThatWasFoundIsNoPushOfARobotThatStands) {
  for (const bool left : {true, false}) {
    for (const double part : {0.0, 1.0}) {
      const auto fault = [&](Observation& y) {
        Off{-3.0, part}(y);
        if (!left) y = mirrored(y);
      };
      Robot robot = settled();
      robot.drive(kStraight, 15, fault);
      const Fault found = robot.monitor.report().fault();
      ASSERT_NE(found, Fault::none);
      robot.drive(kStand, 60);
      EXPECT_EQ(robot.monitor.report().fault(), found) << "at rest nothing shows";
      const FaultReport& report = robot.drive(kStand, 15, fault);
      EXPECT_FALSE(report.moved);
      EXPECT_EQ(report.fault(), found);
    }
  }
}

TEST(FaultIsolation, ABodyThatIsMovedOnSlidingTyresBlamesNobodyWhileItIsAndAfterwards) {
  for (const bool turned : {true, false}) {
    Robot robot;
    robot.drive(kStand, 150);
    robot.drive(kStand, 25, [](Observation& y) { y.yaw_rate += 1.0, y.acceleration_x += 15.0; });
    ASSERT_TRUE(robot.monitor.report().moved);
    for (int k = 0; k < 100; ++k) {
      const FaultReport& report = robot.drive(kStand, 1, [turned](Observation& y) {
        if (turned) y.yaw_rate += 1.0;
        if (!turned) y.acceleration_x += 15.0;
      });
      ASSERT_TRUE(report.moved) << turned << ", " << k;
      ASSERT_FALSE(report.faulty()) << turned << ", " << k;
    }
    int samples = 0;
    while (robot.drive(kStand, 1).moved && samples < 100) ++samples;
    ASSERT_GT(samples, 4) << "it may only seem to have ended";
    ASSERT_LT(samples, 30);
    for (int k = 0; k < 30; ++k, robot.drive(kStand, 1)) {
      ASSERT_TRUE(robot.monitor.report().valid().all()) << turned << ", " << k;
    }
  }
}

TEST(FaultIsolation, ARobotThatDrivesIsNotMoved) {
  Robot robot = settled();
  const FaultReport& report =
      robot.drive(kStraight, 25, [](Observation& y) { y.yaw_rate += 1.0, y.acceleration_x += 15.0; });
  EXPECT_FALSE(report.moved);
  EXPECT_EQ(report.gyro.state, ChannelState::faulty);
  EXPECT_EQ(report.accelerometer.state, ChannelState::faulty);
}

// Accelerations.

TEST(FaultIsolation, ACollisionTakesTheSpeedOfTheBody) {
  GeometryParameters geometry;
  geometry.slip_factor = 0.8;
  const auto afterTaking = [&](double part, int samples) {
    Robot robot({}, model(), geometry);
    robot.noise = 0.0;
    robot.drive(kFast, 300);
    const double speed = kRadius * geometry.slip_factor * kFast.left;
    return robot.drive(kFast, samples, [&](Observation& y) { y.acceleration_x -= part * speed / 0.02; })
        .accelerometer.state;
  };
  EXPECT_EQ(afterTaking(1.2, 1), ChannelState::ok);
  EXPECT_EQ(afterTaking(0.2, 25), ChannelState::faulty) << "five times the speed there is";
}

TEST(FaultIsolation, ABodyMayAccelerateAsFastAsItsDriveTrainsMay) {
  PlantModel real = model();
  real.acceleration_limit *= 2.7;
  const auto largestDoubt = [&](const WheelCommand& from, const WheelCommand& to, double more) {
    Robot robot({}, model(), real);
    robot.noise = 0.0;
    robot.drive(from, 300);
    double largest = 0.0;
    for (int k = 0; k < 15; ++k) {
      robot.drive(to, 1, [&](Observation& y) { y.acceleration_x += std::abs(y.acceleration_x) > 1.0 ? more : 0.0; });
      const ChannelHealth& health = robot.monitor.report().accelerometer;
      largest = std::max(largest, health.state == ChannelState::faulty ? 1.0 : health.probability);
    }
    return largest;
  };
  EXPECT_LT(largestDoubt(kStand, kFast, 0.0), 0.01);
  EXPECT_LT(largestDoubt(kFast, kStand, 0.0), 0.01);
  EXPECT_GT(largestDoubt(kStand, kFast, 20.0), 0.9);
  EXPECT_GT(largestDoubt(kFast, kStand, -20.0), 0.9);
}

TEST(FaultIsolation, AJoltThatTheAccelerometerSawIsNoFaultOfTheGyro) {
  const auto gyroAfter = [](bool has_accelerometer) {
    Robot robot = settled(kFast);
    robot.drive(kFast, 1, [](Observation& y) { y.acceleration_x -= 24.0; });
    EXPECT_TRUE(robot.monitor.report().shaken);
    EXPECT_STREQ(robot.monitor.report().reason(), "");
    const FaultReport& report = robot.drive(kFast, 1, [=](Observation& y) {
      y.yaw_rate += 0.5;
      y.valid.acceleration = has_accelerometer;
    });
    EXPECT_TRUE(report.shaken);
    return report.gyro.state;
  };
  EXPECT_EQ(gyroAfter(true), ChannelState::ok);
  EXPECT_EQ(gyroAfter(false), ChannelState::ok);
}

// What is known of the commands.

TEST(FaultIsolation, EveryCommandCountsForAsLongAsItWasApplied) {
  Robot robot = settled(kStand, exactParameters(), exactModel());
  for (int k = 0; k < 50; ++k) {
    robot.pass(kFast, 0.013);
    const FaultReport& report = robot.drive(kStand, 1);
    EXPECT_LT(report.wheel_left.distance, 0.01) << k;
    EXPECT_LT(report.wheel_right.distance, 0.01) << k;
  }
}

TEST(FaultIsolation, TimeThatPassesAtOnceIsThatOfManySteps) {
  Robot robot;
  FaultMonitor at_once({}, {}, model());
  for (const WheelCommand& command : {kStraight, WheelCommand{-3.0, 6.0}, kFast, kStand}) {
    for (int k = 0; k < 10; ++k) {
      for (const WheelCommand& part : {command, kStraight}) {  // no sample between the two
        robot.pass(part, 0.05);
        at_once.advance(part, 0.05);
      }
      const Observation y = robot.sample();
      const FaultReport &expected = robot.monitor.check(y), &report = at_once.check(y);
      ASSERT_NEAR(report.wheel_left.distance, expected.wheel_left.distance, 1e-9);
      ASSERT_NEAR(report.wheel_right.distance, expected.wheel_right.distance, 1e-9);
      ASSERT_NEAR(report.gyro.distance, expected.gyro.distance, 1e-9);
      ASSERT_NEAR(report.accelerometer.distance, expected.accelerometer.distance, 1e-9);
    }
  }
}

/// Distances of both wheels after some samples of a robot that is to drive off. @param moves it does.
double distanceOfWheels(Robot& robot, bool moves) {
  const FaultReport& report = robot.drive(kStraight, 5, [&](Observation& y) {
    if (!moves) y.wheel_left = y.wheel_right = 0.0;
  });
  EXPECT_NEAR(report.wheel_left.distance, report.wheel_right.distance, 1e-9);
  return report.wheel_left.distance;
}

TEST(FaultIsolation, CommandsOfAQuarterOfASecondTellWhatIsUnderWay) {
  const auto distance = [](double known_for, bool moves) {
    Robot robot(exactParameters(), exactModel());
    robot.noise = 0.0;
    robot.pass(kStraight, known_for);
    return distanceOfWheels(robot, moves);
  };
  EXPECT_LT(distance(0.26, true), 0.01) << "under way, as it was told";
  EXPECT_GT(distance(0.26, false), 0.05);
  EXPECT_LT(distance(0.20, false), 0.01) << "who knows what came before";
  EXPECT_GT(distance(0.20, true), 0.05);
}

TEST(FaultIsolation, AfterARestartTheCommandsBeforeAreNotKnown) {
  Robot robot = settled(kStand, exactParameters(), exactModel());
  robot.pass(kStraight, 0.2);
  robot.monitor.restart();
  EXPECT_LT(distanceOfWheels(robot, false), 0.01);
  Robot fresh(exactParameters(), exactModel());
  fresh.noise = 0.0;
  fresh.pass(kStraight, 0.3);
  fresh.monitor.restart();
  EXPECT_LT(distanceOfWheels(fresh, false), 0.01) << "nor those before the first sample";
}

TEST(FaultIsolation, WheelsThatSomebodyElseDrivesAreFollowedUntilTheRestart) {
  Robot robot(exactParameters(), exactModel());
  robot.noise = 0.0;
  robot.known = false;
  for (const WheelCommand& command : {WheelCommand{5.0, 2.0}, WheelCommand{-4.0, 3.0}, WheelCommand{6.0, 6.0}}) {
    for (int k = 0; k < 100; ++k) {
      const FaultReport& report = robot.drive(command, 1);
      EXPECT_TRUE(report.valid().wheel_left && report.valid().wheel_right) << k;
      EXPECT_LT(std::max(report.wheel_left.distance, report.wheel_right.distance), 0.01) << k;
    }
  }
  for (const bool left : {true, false}) {  // a wheel that is not measured goes on as it was
    const FaultReport& report = robot.drive(
        {6.0, 6.0}, 25, [left](Observation& y) { (left ? y.valid.wheel_left : y.valid.wheel_right) = false; });
    EXPECT_LT(report.gyro.distance, 0.5) << left;
    robot.drive({6.0, 6.0}, 5);
  }
  robot.monitor.restart();
  robot.known = true;
  robot.pass({0.0, 0.0}, 0.3);  // under way to rest
  for (int k = 0; k < 8; ++k) EXPECT_LT(robot.drive({0.0, 0.0}, 1).wheel_left.distance, 0.01) << k;
}

TEST(FaultIsolation, ARestartForgetsWhoDroveTheWheels) {
  for (const bool left : {true, false}) {
    Robot robot(exactParameters(), exactModel());
    robot.noise = 0.0;
    robot.known = false;
    robot.drive(kStraight, 300);
    robot.pass(kStand, 2.0);
    robot.monitor.restart();
    const FaultReport& report =
        robot.drive(kStand, 25, [left](Observation& y) { (left ? y.valid.wheel_left : y.valid.wheel_right) = false; });
    EXPECT_LT(report.gyro.distance, 0.5) << left;
  }
}

// Restarts.

TEST(FaultIsolation, ARestartForgetsTimeMotionAndFaults) {
  Robot robot;
  robot.drive(kStraight, 200);
  robot.drive(kStraight, 30, [](Observation& y) { y.yaw_rate = 0.001, y.acceleration_x = 0.01; });
  ASSERT_FALSE(robot.monitor.report().valid().yaw_rate || robot.monitor.report().valid().acceleration);
  robot.monitor.restart();
  EXPECT_FALSE(robot.monitor.report().faulty());
  Observation y;  // of another time, at rest
  y.stamp = 0.5;
  y.acceleration_z = kGravity;
  for (int k = 0; k < 5; ++k, y.stamp += 0.02) {
    EXPECT_TRUE(robot.monitor.check(y).valid().all()) << k;
    robot.monitor.advance(kStand, 0.02);
  }
  y.wheel_left = 5.0;
  EXPECT_EQ(robot.monitor.check(y).wheel_left.state, ChannelState::outlier) << "the samples of this time count";
}

TEST(FaultIsolation, NoiseIsForgottenWithTheEncodersOnly) {
  enum class Forgets { nothing, encoders, everything };
  const auto findsFrozen = [](Forgets forgets, bool left) {
    Robot robot;
    robot.drive(kStraight, 200);
    if (forgets == Forgets::everything) robot.monitor.reset();
    if (forgets != Forgets::everything) robot.monitor.restart();
    if (forgets == Forgets::encoders) robot.monitor.forgetEncoders();
    const FaultReport& report =
        robot.drive(kStraight, 50, [left](Observation& y) { (left ? y.wheel_left : y.wheel_right) = 5.01; });
    return (left ? report.wheel_left : report.wheel_right).cause == FaultCause::frozen;
  };
  for (const bool left : {true, false}) {
    EXPECT_TRUE(findsFrozen(Forgets::nothing, left));
    EXPECT_FALSE(findsFrozen(Forgets::encoders, left));
    EXPECT_FALSE(findsFrozen(Forgets::everything, left));
  }
}

TEST(FaultIsolation, ResetForgetsBiasAndInclination) {
  const auto valid = [](bool reset, double yaw_rate, double acceleration) {
    Robot robot;
    robot.noise = 0.0;
    robot.drive(kStand, 300, [](Observation& y) { y.yaw_rate = 0.045, y.acceleration_x = 2.0; });
    if (reset) robot.monitor.reset();
    if (!reset) robot.monitor.restart();
    robot.noise = 0.1;
    robot.drive(kStand, 25, [&](Observation& y) { y.yaw_rate += yaw_rate, y.acceleration_x += acceleration; });
    return robot.monitor.report().valid();
  };
  EXPECT_TRUE(valid(true, -0.045, 2.0).all());
  EXPECT_TRUE(valid(true, 0.045, -2.0).all());
  EXPECT_FALSE(valid(false, -0.045, 2.0).yaw_rate) << "a restart does not";
  EXPECT_FALSE(valid(false, 0.045, -2.0).acceleration);
}

// Traction.

/// Whether a robot whose wheels spin up while its body stands is reported as stuck.
bool tellsStuck(const PlantModel& told, bool has_accelerometer = true) {
  Robot robot({}, told);
  const auto stands = [&](Observation& y) {
    y.acceleration_x = 0.02 * std::sin(1e4 * y.stamp);
    y.yaw_rate = 0.005 * std::sin(2e4 * y.stamp);
    y.valid.acceleration = has_accelerometer;
  };
  robot.drive(kStand, 100, stands);
  bool stuck = false;
  for (int k = 0; k < 200; ++k) stuck |= robot.drive(kFast, 1, stands).stuck;
  return stuck;
}

TEST(FaultIsolation, ARobotThatDoesNotFollowItsWheelsIsStuck) {
  PlantModel box = model();
  box.on_box = true;
  EXPECT_TRUE(tellsStuck(model()));
  EXPECT_FALSE(tellsStuck(box));
  EXPECT_FALSE(tellsStuck(model(), false)) << "who could know";
}

TEST(FaultIsolation, StuckIsForgottenWithoutAnAccelerometerAndWithARestart) {
  for (const int way : {0, 1, 2}) {
    Robot robot;
    const auto stands = [&](Observation& y) {
      y.acceleration_x = 0.02 * std::sin(1e4 * y.stamp);
      y.yaw_rate = 0.005 * std::sin(2e4 * y.stamp);
    };
    robot.drive(kStand, 100, stands);
    robot.drive(kFast, 200, stands);
    ASSERT_TRUE(robot.monitor.report().stuck);
    if (way == 1) robot.monitor.restart();
    if (way == 2) robot.monitor.reset();
    robot.drive(kFast, 1, [&](Observation& y) {
      stands(y);
      y.valid.acceleration = way != 0;
    });
    EXPECT_FALSE(robot.monitor.report().stuck) << way;
  }
}

}  // namespace
}  // namespace jackal_aic
