#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "watched_robot.hpp"

/// @file
/// Which of the robot's sensors and drives is found faulty, and what the monitor makes of pushes, kerbs, lost
/// channels and restarts.

namespace jackal_aic {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A model of a robot that turns half as fast.
PlantModel wideModel() {
  return changed(model(), [](PlantModel& m) { m.effective_track = 2.0 * kTrack; });
}

// ---- encoder or drive

TEST(FaultIsolation, TheGyroTellsAnEncoderFromADrive) {
  const struct {
    const char* why;
    Off off;
    int samples;
    Fault fault;
    bool wide = false;
  } rows[] = {
      {"(1 - part)^2 against 2 part^2: from 0.414 on", {-5.0, 0.38}, 15, Fault::left_encoder_wrong},
      {"it agrees with the encoder", {-5.0, 0.46}, 15, Fault::left_wheels_blocked},
      {"the body had no time to turn, or not to", {-5.0, 0.0}, 8, Fault::none},
      {"the body had no time to turn", {-5.0, 1.0}, 8, Fault::none},
      {"it had time", {-5.0, 0.0}, 13, Fault::left_encoder_wrong},
      {"it had time", {-5.0, 1.0}, 13, Fault::left_wheels_blocked},
      {"a wheel that is dragged along has 0.6 s", {2.0, 1.0}, 25, Fault::none},
      {"a wheel that is dragged along has 0.6 s", {2.0, 1.0}, 35, Fault::left_wheels_blocked},
      {"nothing turns: it is the encoder", {2.0, 0.0}, 25, Fault::left_encoder_wrong},
      {"neither explains it", {2.0, 0.35}, 25, Fault::none},
      {"neither explains it", {2.0, 0.35}, 35, Fault::left_encoder_wrong},
      {"no evidence for either", {0.6, 0.45, 0.5}, 18, Fault::none, true},
      {"it turns on, and a small error of the yaw rate is no evidence", {-0.5, 0.4, 0.5}, 100, Fault::none, true},
      {"a larger one is", {-0.55, 0.25, 0.5}, 15, Fault::left_encoder_wrong, true}};
  for (const auto& row : rows) {
    SCOPED_TRACE(testing::Message() << row.why << ": " << row.off.speed << ", " << row.off.part);
    Robot robot = settled(kStraight, {}, row.wide ? wideModel() : model());
    const FaultReport& report = robot.drive(kStraight, row.samples, row.off);
    EXPECT_EQ(report.fault(), row.fault);
    EXPECT_TRUE(row.samples != 100 || report.valid().wheel_left);
  }
}

/// The turn alone does not tell it from other ground, because the turn of an assumed robot may differ by half.
TEST(FaultIsolation, AnEncoderAtHalfInATurnIsFoundOnAnAssumedRobot) {
  for (const double speed : {1.4, 2.3, 4.0}) {
    const WheelCommand turn{-speed, speed};
    Robot robot({}, assumedModel());
    robot.drive(turn, 3 * kSecond);
    EXPECT_EQ(robot.drive(turn, 15, [](Observation& y) { y.wheel_left *= 0.5; }).fault(), Fault::left_encoder_wrong)
        << speed;
  }
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
  EXPECT_TRUE(with([](Observation& y) { y.valid.yaw_rate = false; }, stops, model()).blocked());
  EXPECT_TRUE(
      with([](Observation& y) { y.yaw_rate += 1.0; }, [](Observation& y) { y.wheel_left = y.yaw_rate = 0.0; }, model())
          .blocked())
      << "it was found faulty";
  EXPECT_TRUE(with([](Observation& y) { y.acceleration_x += 20.0; }, stops, model()).blocked())
      << "the accelerometer of the same IMU was";
  EXPECT_TRUE(with([](Observation& y) { y.valid.wheel_right = false; }, stops, model()).blocked())
      << "the other wheel is not measured";
  EXPECT_TRUE(with(nothing, stops, boxModel()).blocked());
}

TEST(FaultIsolation, AWitnessThatIsLostOrComesBack) {
  Robot robot = settled();
  robot.drive(kStraight, 15, Off{-5.0, 0.0});
  const FaultReport& later = robot.drive(kStraight, 15, [](Observation& y) {
    y.wheel_left = 0.0;
    y.valid.yaw_rate = false;
  });
  EXPECT_EQ(later.fault(), Fault::left_encoder_wrong) << "what was told stays";
  Robot back = settled();
  back.drive(kStraight, 5, [](Observation& y) {
    Off{-5.0, 1.0}(y);
    y.valid.yaw_rate = false;
    y.yaw_rate = kNan;
  });
  EXPECT_EQ(back.drive(kStraight, 10, Off{-5.0, 1.0}).fault(), Fault::left_wheels_blocked);
}

TEST(FaultIsolation, ADriveAndAnEncoderCountAgainAfterASecond) {
  for (const double part : {0.0, 1.0}) {
    Robot robot = settled();
    ASSERT_TRUE(robot.drive(kStraight, 15, Off{-5.0, part}).faulty());
    EXPECT_TRUE(robot.drive(kStraight, 40).faulty());
    EXPECT_FALSE(robot.drive(kStraight, 15).faulty());
    EXPECT_FALSE(robot.monitor.report().blocked());
    EXPECT_EQ(robot.monitor.report().wheel_left.fault, Fault::none);
  }
}

TEST(FaultIsolation, SpikesOfAnEncoderAreAFaultIfTheyComeOften) {
  for (const auto& [every, samples, fault] :
       {std::tuple(3, 25, Fault::left_encoder_wrong), std::tuple(50, 1000, Fault::none)}) {
    Robot robot(exactParameters(), model());
    robot.drive(kStraight, 6 * kSecond);
    int sample = 0;
    robot.drive(kStraight, samples, [&, n = every](Observation& y) { y.wheel_left += ++sample % n == 0 ? 3.0 : 0.0; });
    EXPECT_EQ(robot.monitor.report().fault(), fault) << "one in " << every << " samples";
  }
}

TEST(FaultIsolation, AWheelThatWasHeldUpCountsOnItsWay) {
  for (const bool left : {true, false}) {
    Robot robot = settled();
    double speed = 0.0;
    const auto held = [&](Observation& y) {
      Off{speed - y.wheel_left, 1.0}(y);
      if (!left) y = mirrored(y);
    };
    robot.drive(kStraight, 7, held);
    EXPECT_EQ(wheelOf(robot, left).state, ChannelState::outlier);
    for (speed = 0.16; speed < 5.0; speed += 0.16) {  // 8 rad/s^2
      EXPECT_FALSE(robot.drive(kStraight, 1, held).faulty()) << speed;
      EXPECT_TRUE(speed < 0.2 || wheelOf(robot, left).state == ChannelState::ok) << speed;
    }
  }
}

/// The left encoder repeats every value, so that less is known of it than of the right one.
TEST(FaultIsolation, EncodersThatFreezeTogetherAreFoundTogether) {
  for (const bool left : {true, false}) {
    Robot robot;
    double last = 0.0;
    bool repeats = false;
    robot.drive(kStraight, 2 * kSecond);
    robot.drive({5.0, 5.1}, 2 * kSecond, [&](Observation& y) {
      double& value = wheelOf(y, left);
      if (repeats) value = last;
      last = value;
      repeats = !repeats;
    });
    for (int k = 0; k < 20; ++k) {
      const FaultReport& report =
          robot.drive({5.0, 5.1}, 1, [](Observation& y) { y.wheel_left = 5.01, y.wheel_right = 5.12; });
      ASSERT_EQ(report.wheel_left.fault == Fault::left_encoder_frozen,
                report.wheel_right.fault == Fault::right_encoder_frozen)
          << k;
    }
    EXPECT_EQ(robot.monitor.report().wheel_left.fault, Fault::left_encoder_frozen);
  }
}

// ---- gyro and accelerometer

TEST(FaultIsolation, TheGyroIsJudgedByWheelsThatAreNotSuspect) {
  for (const bool left : {true, false}) {
    Robot robot = settled();
    const double before = robot.monitor.report().gyro.probability;
    const FaultReport& suspect =
        robot.drive(kStraight, 1, [&](Observation& y) { wheelOf(y, left) += 10.0, y.yaw_rate += 0.5; });
    EXPECT_EQ(wheelOf(robot, left).state, ChannelState::outlier);
    EXPECT_EQ(suspect.gyro.state, ChannelState::ok);
    EXPECT_NEAR(suspect.gyro.probability, before, 1e-4);

    Robot faulty = settled();
    const auto wrong = [left](Observation& y) { wheelOf(y, left) -= 3.0; };
    ASSERT_TRUE(faulty.drive(kStraight, 15, wrong).faulty());
    EXPECT_EQ(faulty.monitor.report().gyro.state, ChannelState::ok);
    const FaultReport& report = faulty.drive(kStraight, 20, [&](Observation& y) { wrong(y), y.yaw_rate += 0.5; });
    EXPECT_EQ(report.gyro.state, ChannelState::faulty) << "by the other wheel";
  }
}

TEST(FaultIsolation, ChannelsThatWereLostKeepTheirVerdictAndAreJudgedAgain) {
  const auto lose = [](Observation& y) {
    y.valid = {false, true, true, false};
    y.yaw_rate = y.acceleration_x = kNan;
  };
  const auto after = [&](auto fault) {
    Robot robot = settled();
    robot.drive(kStraight, kSecond, lose);
    EXPECT_TRUE(robot.drive(kStraight, 5).valid().all());
    return robot.drive(kStraight, 20, fault).fault();
  };
  EXPECT_EQ(after([](Observation& y) { y.yaw_rate += 0.2; }), Fault::gyro_disagrees);
  EXPECT_EQ(after([](Observation& y) { y.acceleration_x += 12.0; }), Fault::accelerometer_disagrees);
  Robot faulty = settled();
  faulty.drive(kStraight, 20, [](Observation& y) { y.yaw_rate += 0.3, y.acceleration_x += 20.0; });
  EXPECT_FALSE(faulty.monitor.report().moved) << "it drives";
  const FaultReport& lost = faulty.drive(kStraight, 2 * kSecond, lose);
  EXPECT_EQ(lost.gyro.state, ChannelState::faulty);
  EXPECT_EQ(lost.accelerometer.state, ChannelState::faulty);
}

TEST(FaultIsolation, OnABoxTheGyroMayFreezeAndTheInclinationChange) {
  for (const WheelCommand& command : {kStraight, kTurn}) {
    Robot robot({}, boxModel());
    const auto stands = [](Observation& y) {
      y.yaw_rate = 0.003 * std::sin(1e4 * y.stamp), y.acceleration_x = 0.01 * std::sin(1e4 * y.stamp);
    };
    EXPECT_FALSE(robot.drive(command, 6 * kSecond, stands).faulty()) << "it does not turn with its wheels";
    const FaultReport& frozen = robot.drive(command, 30, [&](Observation& y) { stands(y), y.yaw_rate = 0.001; });
    EXPECT_EQ(frozen.fault(), Fault::gyro_frozen);
  }
  Robot robot({}, boxModel());
  double inclined = 0.0;
  const auto tilts = [&](Observation& y) { y.yaw_rate = 0.0, y.acceleration_x = inclined; };
  robot.drive(kStand, 20 * kSecond, tilts);
  for (; inclined < 2.0; inclined += 0.01) {
    EXPECT_LT(robot.drive(kStand, 1, tilts).accelerometer.probability, 0.1) << inclined;
  }
}

TEST(FaultIsolation, ABodyMayAccelerateAsFastAsItsDriveTrainsMay) {
  const PlantModel real = changed(model(), [](PlantModel& m) { m.acceleration_limit *= 2.7; });
  const auto largestDoubt = [&](const WheelCommand& from, const WheelCommand& to, double more) {
    Robot robot({}, model(), real);
    robot.noise = 0.0;
    robot.drive(from, 6 * kSecond);
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
  for (const bool has_accelerometer : {true, false}) {  // with the next sample
    Robot robot = settled(kFast);
    robot.drive(kFast, 1, [](Observation& y) { y.acceleration_x -= 24.0; });
    EXPECT_TRUE(robot.monitor.report().shaken);
    EXPECT_STREQ(robot.monitor.report().reason(), "");
    const FaultReport& report =
        robot.drive(kFast, 1, [=](Observation& y) { y.yaw_rate += 0.5, y.valid.acceleration = has_accelerometer; });
    EXPECT_TRUE(report.shaken);
    EXPECT_EQ(report.gyro.state, ChannelState::ok);
  }
}

// ---- pushes

TEST(FaultIsolation, AWheelThatTurnsWhileTheOtherIsToTurnIsNotPushed) {
  for (const bool left : {true, false}) {
    const WheelCommand command{left ? 0.0 : 5.0, left ? 5.0 : 0.0};
    Robot robot = settled(command);
    for (int k = 0; k < kSecond; ++k) {
      EXPECT_FALSE(robot.drive(command, 1, [left](Observation& y) { wheelOf(y, left) += 3.0; }).moved);
    }
    EXPECT_TRUE(robot.monitor.report().faulty());
  }
}

TEST(FaultIsolation, AFaultThatWasFoundIsNoPushOfARobotThatStands) {
  for (const bool left : {true, false}) {
    for (const double part : {0.0, 1.0}) {
      const auto fault = offOn(left, -3.0, part);
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
    robot.drive(kStand, 3 * kSecond);
    robot.drive(kStand, 25, [](Observation& y) { y.yaw_rate += 1.0, y.acceleration_x += 15.0; });
    ASSERT_TRUE(robot.monitor.report().moved);
    for (int k = 0; k < 100; ++k) {
      const FaultReport& report = robot.drive(
          kStand, 1, [=](Observation& y) { (turned ? y.yaw_rate : y.acceleration_x) += turned ? 1.0 : 15.0; });
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

// ---- what is known of the commands

/// A robot without noise of which nothing is open, before its first sample.
Robot fresh() {
  Robot robot(exactParameters());
  robot.noise = 0.0;
  return robot;
}

TEST(FaultIsolation, CommandsOfAQuarterOfASecondTellWhatIsUnderWayUntilARestart) {
  const auto distance = [](Robot robot, bool moves) {  // of both wheels, of a robot that is to drive off
    const FaultReport& report = robot.drive(kStraight, 5, [&](Observation& y) {
      if (!moves) y.wheel_left = y.wheel_right = 0.0;
    });
    EXPECT_NEAR(report.wheel_left.distance, report.wheel_right.distance, 1e-9);
    return report.wheel_left.distance;
  };
  Robot known = fresh(), unknown = fresh(), driven = settled(kStand, exactParameters()), never_measured = fresh();
  known.pass(kStraight, 0.26);
  unknown.pass(kStraight, 0.20);
  driven.pass(kStraight, 0.2);
  never_measured.pass(kStraight, 0.3);
  EXPECT_LT(distance(known, true), 0.01) << "under way, as it was told";
  EXPECT_GT(distance(known, false), 0.05);
  EXPECT_LT(distance(unknown, false), 0.01) << "who knows what came before";
  EXPECT_GT(distance(unknown, true), 0.05);
  for (Robot* robot : {&driven, &never_measured}) {
    robot->monitor.restart();
    EXPECT_LT(distance(*robot, false), 0.01) << "what came before is not known";
  }
}

TEST(FaultIsolation, WheelsThatSomebodyElseDrivesAreFollowedUntilTheRestart) {
  Robot robot = fresh();
  robot.known = false;
  for (const WheelCommand& command : {WheelCommand{5.0, 2.0}, WheelCommand{-4.0, 3.0}, WheelCommand{6.0, 6.0}}) {
    for (int k = 0; k < 2 * kSecond; ++k) {
      const FaultReport& report = robot.drive(command, 1);
      EXPECT_TRUE(report.valid().wheel_left && report.valid().wheel_right) << k;
      EXPECT_LT(std::max(report.wheel_left.distance, report.wheel_right.distance), 0.01) << k;
    }
  }
  robot.monitor.restart();
  robot.known = true;
  robot.pass(kStand, 0.3);  // under way to rest
  for (int k = 0; k < 8; ++k) EXPECT_LT(robot.drive(kStand, 1).wheel_left.distance, 0.01) << k;
}

// ---- restarts

TEST(FaultIsolation, ARestartForgetsTimeMotionAndFaults) {
  Robot robot;
  robot.drive(kStraight, 4 * kSecond);
  robot.drive(kStraight, 30, [](Observation& y) { y.yaw_rate = 0.001, y.acceleration_x = 0.01; });
  ASSERT_FALSE(robot.monitor.report().valid().yaw_rate || robot.monitor.report().valid().acceleration);
  robot.monitor.restart();
  EXPECT_FALSE(robot.monitor.report().faulty());
  Observation y;  // of another time, at rest
  y.stamp = 0.5;
  y.acceleration_z = kGravity;
  for (int k = 0; k < 5; ++k, y.stamp += kPeriod) {
    EXPECT_TRUE(robot.monitor.check(y).valid().all()) << k;
    robot.monitor.advance(kStand, kPeriod);
  }
  y.wheel_left = 5.0;
  EXPECT_EQ(robot.monitor.check(y).wheel_left.state, ChannelState::outlier) << "the samples of this time count";
}

TEST(FaultIsolation, NoiseIsForgottenWithTheEncodersOnly) {
  enum class Forgets { nothing, encoders, everything };
  const auto findsFrozen = [](Forgets forgets, bool left) {
    Robot robot;
    robot.drive(kStraight, 4 * kSecond);
    if (forgets == Forgets::everything) robot.monitor.reset();
    if (forgets != Forgets::everything) robot.monitor.restart();
    if (forgets == Forgets::encoders) robot.monitor.forgetEncoders();
    robot.drive(kStraight, kSecond, [left](Observation& y) { wheelOf(y, left) = 5.01; });
    return wheelOf(robot, left).fault == (left ? kLeftWheels : kRightWheels).frozen;
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
    robot.drive(kStand, 6 * kSecond, [](Observation& y) { y.yaw_rate = 0.045, y.acceleration_x = 2.0; });
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

// ---- traction

/// Turns the wheels of a robot whose body stands. @returns whether it was reported as stuck.
bool spins(Robot& robot, const WheelCommand& command, int samples, bool has_accelerometer = true) {
  const auto stands = [=](Observation& y) {
    y.acceleration_x = 0.02 * std::sin(1e4 * y.stamp);
    y.yaw_rate = 0.005 * std::sin(2e4 * y.stamp);
    y.valid.acceleration = has_accelerometer;
  };
  bool stuck = false;
  for (; samples > 0; --samples) stuck |= robot.drive(command, 1, stands).stuck;
  return stuck;
}

TEST(FaultIsolation, ARobotThatDoesNotFollowItsWheelsIsStuckUntilNobodyKnows) {
  Robot on_box({}, boxModel()), robot;
  for (Robot* standing : {&on_box, &robot}) spins(*standing, kStand, 2 * kSecond);
  Robot blind = robot;
  EXPECT_FALSE(spins(on_box, kFast, 4 * kSecond));
  EXPECT_FALSE(spins(blind, kFast, 4 * kSecond, false)) << "who could know";
  ASSERT_TRUE(spins(robot, kFast, 4 * kSecond));
  ASSERT_TRUE(robot.monitor.report().stuck);
  Robot restarted = robot, reset = robot;
  restarted.monitor.restart();
  reset.monitor.reset();
  EXPECT_FALSE(spins(robot, kFast, 1, false));
  EXPECT_FALSE(spins(restarted, kFast, 1) || spins(reset, kFast, 1));
}

}  // namespace
}  // namespace jackal_aic
