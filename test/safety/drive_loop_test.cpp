#include "jackal_aic/safety/drive_loop.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "jackal_aic/safety/loop_odometry.hpp"

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;  // s
constexpr double kTick = 0.001;   // s

DriveParameters thesis() {
  DriveParameters parameters;
  parameters.controller = ControllerParameters{};
  return parameters;
}

DriveParameters predictive() {
  DriveParameters parameters;
  parameters.controller = PredictiveParameters{};
  parameters.plant_model = PlantModel{};
  parameters.plant_model->identified = true;
  parameters.on_loss.one_wheel = LossAction::drive;
  return parameters;
}

/// A robot whose wheels do what they are told after a lag, and a drive loop that it is served by.
class DriveLoopTest : public testing::Test {
 protected:
  explicit DriveLoopTest(const DriveParameters& parameters = thesis())
      : kinematics(parameters.geometry), loop(parameters, makeController(parameters)) {
    loop.release();
  }

  /// Drives for a time [s]. @param sources that send: w for the wheels, i for the IMU, p for pairs, x for pairs of
  /// which no wheel can be believed, l for an IMU that comes late, and for its pairs, t for a second message of the
  /// wheels close behind the first, 5 for an IMU of 5 Hz and its pairs, 4 for one of 4 Hz, s for the set point. A
  /// synchroniser knows the pair of a slow IMU with the next message of the wheels, before they are told by themselves.
  void drive(double duration, const std::string& sources = "wips") {
    const auto sends = [&sources](char source) { return sources.find(source) != std::string::npos; };
    for (long end = tick + std::lround(duration / kTick); tick < end; ++tick) {
      now = start + kTick * static_cast<double>(tick);
      speed += (command.vector() - speed) * kTick / 0.1;
      if (sends('4') && tick % 260 == 25) loop.observe(sample(), now);
      if (tick % 20 == 5) {
        const Observation y = sample();
        Observation wheels = y, imu = y;
        wheels.valid.yaw_rate = wheels.valid.acceleration = false;
        imu.valid.wheel_left = imu.valid.wheel_right = false;
        FrozenSource::Sample changing = FrozenSource::Sample::Constant(now);
        if (sends('w')) loop.receiveWheels({wheels, changing}, now);
        if (sends('i')) loop.receiveImu({imu, imu_repeats ? FrozenSource::Sample::Zero() : changing}, now);
        if (sends('p')) loop.observe(y, now);
        wheels = y;
        wheels.wheel_left = wheels.wheel_right = 200.0;
        if (sends('x')) loop.observe(wheels, now);
        sent.push_back(y);
      }
      if (tick % 20 == 15 && sends('l') && sent.size() > kLate) {
        const Observation& late = sent[sent.size() - 1 - kLate];
        loop.observe(late, now);
        loop.receiveImu({late, FrozenSource::Sample::Constant(now)}, now);
      }
      if (tick % 20 == 6 && sends('t')) sendTwin();
      if (sends('5') && tick % 200 == 25) loop.observe(sent[sent.size() - 2], now);
      if ((sends('5') && tick % 200 == 11) || (sends('4') && tick % 260 == 21)) sendImu();
      if (tick % 100 == 0 && sends('s')) loop.setSetPoint(set_point, now);
      loop.report(robot, now);
      if (const auto due = loop.advance(now)) {
        EXPECT_TRUE(due->vector().allFinite());
        command = *due;
        ++commands;
      }
    }
  }

  void sendTwin() {
    Observation wheels = sample();
    wheels.stamp = sent.back().stamp + 0.0002;
    wheels.valid.yaw_rate = wheels.valid.acceleration = false;
    loop.receiveWheels({wheels, FrozenSource::Sample::Constant(now)}, now);
  }

  void sendImu() {
    Observation imu = sample();
    imu.valid.wheel_left = imu.valid.wheel_right = false;
    loop.receiveImu({imu, FrozenSource::Sample::Constant(now)}, now);
  }

  Observation sample() const {
    const double noise = 0.001 * static_cast<double>(tick % 7);
    const BodyVector body = kinematics.bodyVelocity({speed(0), speed(1)});
    Observation y;
    y.stamp = now;
    y.wheel_left = speed(0) + noise;
    y.wheel_right = speed(1) - noise;
    y.yaw_rate = body(kYaw) + noise;
    return y;
  }

  DriveStatus status() const { return loop.status().decision.status; }
  std::string why() const { return reason(loop.status()); }

  SkidSteerKinematics kinematics;
  DriveLoop loop;
  SetPoint set_point{0.5, 0.0, 0.0};
  RobotStatus robot;
  double start = 10.0;
  double now = 10.0;
  long tick = 0;
  WheelVector speed = WheelVector::Zero();
  WheelCommand command;
  int commands = 0;
  bool imu_repeats = false;
  static constexpr std::size_t kLate = 13;  // samples
  std::vector<Observation> sent;
};

class PredictiveDriveLoopTest : public DriveLoopTest {
 protected:
  PredictiveDriveLoopTest() : DriveLoopTest(predictive()) {}
};

/// Turns half as fast as a Jackal with the same wheel speeds.
class WideDriveLoopTest : public DriveLoopTest {
 protected:
  WideDriveLoopTest() : DriveLoopTest(wide()) {}
  static DriveParameters wide() {
    DriveParameters parameters = predictive();
    parameters.geometry.effective_track *= 2.0;
    return parameters;
  }
};

TEST_F(WideDriveLoopTest, TurnsAsItsGeometrySaysAndNoSensorIsBlamed) {
  set_point = {0.0, 0.0, 0.8};
  drive(3.0);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
  EXPECT_EQ(why(), "");
  EXPECT_NEAR(kinematics.bodyVelocity({speed(0), speed(1)})(kYaw), 0.8, 0.05);
}

TEST(DriveLoop, WhatASoundSensorCanReadIsOfTheRobotsLimits) {
  DriveParameters parameters = thesis();
  parameters.gate.limits.wheel_speed = 4.0;
  parameters.gate.limits.angular_speed = 1.0;
  parameters.gate.plausibility.speed_factor = 2.0;
  DriveLoop driven(parameters, makeController(parameters));
  Observation y;
  y.stamp = kPeriod;
  y.wheel_left = 7.9;
  y.wheel_right = 8.1;
  y.yaw_rate = 2.1;
  driven.observe(y, y.stamp);
  const ChannelValidity counted = asCounted(y, driven).valid;
  EXPECT_TRUE(counted.wheel_left);
  EXPECT_FALSE(counted.wheel_right);
  EXPECT_FALSE(counted.yaw_rate);
}

/// What the latch has to outlast, with set points all the time.
class LatchedDriveLoopTest : public DriveLoopTest {
 protected:
  LatchedDriveLoopTest() { loop.start({}, now); }

  void driveAfterAZeroSetPoint(double duration) {
    const SetPoint wanted = std::exchange(set_point, SetPoint{});
    drive(0.2);
    set_point = wanted;
    drive(duration);
  }

  /// Sends set points from now on, and expects that none of them moves the robot.
  void expectToStand(double duration) {
    for (long i = std::lround(duration / kPeriod); i > 0; --i) {
      drive(kPeriod);
      ASSERT_EQ(command, WheelCommand{}) << now << " s: " << why();
    }
    EXPECT_EQ(status(), DriveStatus::stopped) << why();
    EXPECT_NE(why().find("zero set point"), std::string::npos) << why();
  }
};

TEST_F(LatchedDriveLoopTest, AClockThatStepsBackAtRestLeavesTheLatchOfAnEmergencyStop) {
  driveAfterAZeroSetPoint(1.8);
  ASSERT_EQ(status(), DriveStatus::driving) << why();
  robot.emergency_stop = true;
  drive(1.0);
  robot.emergency_stop = false;
  drive(3.0);
  ASSERT_EQ(status(), DriveStatus::stopped) << why();
  start -= 0.05;
  expectToStand(3.0);
  EXPECT_EQ(loop.status().clock_resets, 1u);
  driveAfterAZeroSetPoint(1.0);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
}

TEST_F(LatchedDriveLoopTest, AClockThatStepsBackAtRestLeavesTheLatchOfAFault) {
  driveAfterAZeroSetPoint(1.8);
  robot.driver_fault = true;
  drive(1.0);
  robot.driver_fault = false;
  drive(3.0);
  start -= 0.05;
  for (int i = 0; i < 100; ++i) {
    drive(kPeriod);
    ASSERT_EQ(command, WheelCommand{}) << now << " s: " << why();
  }
  EXPECT_EQ(status(), DriveStatus::faulted) << why();
}

TEST_F(LatchedDriveLoopTest, SetPointsThatAreSentAtItsStartDoNotMoveIt) {
  expectToStand(3.0);
  driveAfterAZeroSetPoint(1.0);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
}

// A subscriber needs a moment to find the publisher that sends already.
TEST_F(LatchedDriveLoopTest, SetPointsThatAreHeardShortlyAfterItsStartDoNotMoveIt) {
  drive(0.3, "wip");
  EXPECT_EQ(status(), DriveStatus::idle) << why();
  expectToStand(3.0);
}

TEST_F(LatchedDriveLoopTest, StartedAnewItWaitsAgain) {
  driveAfterAZeroSetPoint(1.8);
  ASSERT_EQ(status(), DriveStatus::driving) << why();
  loop.start({}, now);
  command = {};
  expectToStand(2.0);
}

TEST_F(LatchedDriveLoopTest, StartedAnewOnTheMoveItBrakesAndWaits) {
  driveAfterAZeroSetPoint(1.8);
  const WheelCommand before = command;
  loop.start(before, now);
  drive(kPeriod);
  EXPECT_GT(command.left, 0.8 * before.left) << "no jerk";
  drive(1.0);
  expectToStand(1.0);
}

TEST_F(LatchedDriveLoopTest, APauseAfterTheStartIsEnough) {
  drive(0.6, "wip");
  drive(1.0);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
}

TEST_F(DriveLoopTest, DrivesToTheSetPointWithOneCommandAPeriod) {
  drive(3.0);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
  EXPECT_NEAR(commands, 3.0 / kPeriod, 1.0);
  EXPECT_NEAR(0.098 * speed.mean(), 0.5, 0.02);
  EXPECT_EQ(why(), "");
}

TEST_F(DriveLoopTest, SensorsThatTellNothingLetARobotStandAndNotStart) {
  drive(1.0, "wip");
  drive(1.0, "x");
  EXPECT_EQ(status(), DriveStatus::idle) << why();
  EXPECT_NE(loop.status().decision.cause, StopCause::sensor_fault) << why();
  for (int i = 0; i < 50; ++i) {
    drive(kPeriod, "xs");
    EXPECT_EQ(command, WheelCommand{}) << i;
  }
  EXPECT_EQ(loop.status().decision.cause, StopCause::sensor_fault) << why();
}

TEST_F(DriveLoopTest, AnObservationOfOneSideOrOneImuChannelIsOneOfItsSource) {
  for (const bool left : {true, false}) {
    for (const bool gyro : {true, false}) {
      DriveLoop driven(thesis(), makeController(thesis()));
      driven.advance(now);
      for (int k = 1; k <= 50; ++k) {
        Observation y;
        y.stamp = now + kPeriod * k;
        y.valid.wheel_left = left;
        y.valid.wheel_right = !left;
        y.valid.yaw_rate = gyro;
        y.valid.acceleration = !gyro;
        driven.observe(y, y.stamp);
        driven.setSetPoint({0.1, 0.0, 0.0}, y.stamp);
        driven.advance(y.stamp);
        const StopCause cause = driven.status().decision.cause;
        EXPECT_NE(cause, StopCause::wheels_missing) << "only " << (left ? "left" : "right") << ", sample " << k;
        EXPECT_NE(cause, StopCause::imu_missing) << "only " << (gyro ? "gyro" : "accelerometer") << ", sample " << k;
      }
    }
  }
}

TEST_F(DriveLoopTest, WhicheverCallTellsThatTheClockRanBack) {
  const std::vector<std::function<void(DriveLoop&)>> calls{
      [](DriveLoop& driven) { driven.updateBelief(1.0); }, [](DriveLoop& driven) { driven.report({}, 1.0); },
      [](DriveLoop& driven) { driven.advance(1.0); }, [](DriveLoop& driven) { driven.setSetPoint({}, 1.0); },
      [](DriveLoop& driven) { driven.freezeLearning(true, 1.0); }};
  for (std::size_t i = 0; i < calls.size(); ++i) {
    DriveLoop driven(thesis(), makeController(thesis()));
    driven.advance(10.0);
    calls[i](driven);
    EXPECT_EQ(driven.status().clock_resets, 1u) << "call " << i;
  }
}

TEST_F(PredictiveDriveLoopTest, AListenerIsToldOfEachCallAndOfItsTime) {
  std::vector<std::pair<std::size_t, double>> told;
  loop.listen([&](const DriveInput& input) { told.emplace_back(input.what.index(), input.now); });
  const Observation y = sample();
  loop.advance(10.001);
  loop.updateBelief(10.002);
  loop.report({}, 10.003);
  loop.setSetPoint(set_point, 10.004);
  loop.receiveWheels({y, FrozenSource::Sample::Zero()}, 10.005);
  loop.receiveImu({y, FrozenSource::Sample::Zero()}, 10.006);
  loop.observe(y, 10.007);
  loop.receiveFeedback(10.0, 10.008);
  loop.applied({}, AppliedSource::drive, 10.009);
  loop.setLearned({{0.6, 1.0}}, 10.010);
  loop.freezeLearning(true, 10.011);
  loop.adoptGains(PredictiveParameters{}, 10.012);
  loop.start({}, 10.013);
  std::vector<bool> seen(std::variant_size_v<decltype(DriveInput::what)>);
  ASSERT_EQ(told.size(), seen.size());
  for (std::size_t i = 0; i < told.size(); ++i) {
    EXPECT_NEAR(told[i].second, 10.001 + 0.001 * static_cast<double>(i), 1e-9);
    seen[told[i].first] = true;
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), true), static_cast<long>(seen.size()));
}

TEST_F(DriveLoopTest, AdoptsGainsWhileItDrives) {
  drive(1.0);
  ControllerParameters slow;
  slow.kappa_a *= 0.01;
  loop.adoptGains(slow, now);
  set_point.forward = 1.0;
  drive(0.3);
  EXPECT_LT(0.098 * speed.mean(), 0.55) << "it follows as fast as with the gains of before";
}

// What the action was before the stop is of no use to a robot at rest.
TEST_F(DriveLoopTest, AfterAStopTheActionGoesOnFromRest) {
  drive(2.0);
  const double before = loop.action().left;
  ASSERT_GT(before, 4.0);
  robot.rivals = true;
  drive(3.0);
  ASSERT_EQ(status(), DriveStatus::stopped) << why();
  robot.rivals = false;
  for (int i = 0; i < 40 && status() != DriveStatus::driving; ++i) drive(kTick);
  ASSERT_EQ(status(), DriveStatus::driving) << why();
  EXPECT_LT(loop.action().left, 0.25 * before);
}

TEST_F(DriveLoopTest, AnImuThatComesLateIsNoReasonToMissTheWheels) {
  drive(1.0);
  drive(1.0, "wls");
  EXPECT_EQ(status(), DriveStatus::driving) << why();
  EXPECT_EQ(why(), "yaw rate lost");
  EXPECT_NEAR(0.098 * speed.mean(), 0.5, 0.02);
}

TEST_F(DriveLoopTest, AnImpossibleSampleIsNoneForTheOdometry) {
  for (const double impossible : {1e300, 1e4, std::numeric_limits<double>::quiet_NaN()}) {
    DriveLoop driven(thesis(), makeController(thesis()));
    Odometry odometry = makeOdometry(thesis(), driven);
    for (int k = 1; k <= 100; ++k) {
      Observation y;
      y.stamp = kPeriod * k;
      y.wheel_left = k == 50 ? impossible : 0.0;
      y.yaw_rate = k == 60 ? impossible : 0.0;
      driven.observe(y, y.stamp);
      odometry.observe(asCounted(y, driven));
      driven.advance(y.stamp);
      odometry.advance(driven.command(), kPeriod);
      ASSERT_LT(std::abs(odometry.motion().forward), 0.01) << impossible << ", sample " << k;
      ASSERT_LT(std::abs(odometry.motion().yaw_rate), 0.01) << impossible << ", sample " << k;
    }
    EXPECT_LT(odometry.poseCovariance()(0, 0), 0.01);
  }
}

TEST_F(DriveLoopTest, AStartForgetsThatTheImuRepeated) {
  drive(1.0);
  imu_repeats = true;
  drive(0.6);
  EXPECT_EQ(why(), "yaw rate lost");
  loop.start({}, now);
  loop.release();
  drive(0.2);
  EXPECT_EQ(why(), "");
  drive(0.4);
  EXPECT_EQ(why(), "yaw rate lost");
}

/// Two loops are told the same at the same times, one of them also every belief step: both do the same to the bit.
void expectSameWithoutBeliefTimer(const DriveParameters& parameters) {
  DriveLoop timed(parameters, makeController(parameters)), untimed(parameters, makeController(parameters));
  timed.release();
  untimed.release();
  WheelVector speed = WheelVector::Zero();
  WheelCommand command;
  int commands = 0;
  const SkidSteerKinematics kinematics{GeometryParameters{}};
  for (long tick = 0; tick < 6000; ++tick) {
    const double now = 10.0 + kTick * static_cast<double>(tick);
    speed += (command.vector() - speed) * kTick / 0.1;
    timed.updateBelief(now);
    if (tick % 20 == 0) {
      const auto with = timed.advance(now), without = untimed.advance(now);
      ASSERT_EQ(with.has_value(), without.has_value()) << tick;
      ASSERT_EQ(timed.controller().believedVelocity(), untimed.controller().believedVelocity()) << tick;
      ASSERT_EQ(timed.status().faults_detected, untimed.status().faults_detected) << tick;
      if (!with) continue;
      ASSERT_EQ(with->left, without->left) << tick;
      ASSERT_EQ(with->right, without->right) << tick;
      command = *with;
      ++commands;
    }
    const double between = now + 0.0004;  // the messages
    for (DriveLoop* loop : {&timed, &untimed}) {
      if (tick % 20 == 7) {
        const BodyVector body = kinematics.bodyVelocity({speed(0), speed(1)});
        Observation y;
        y.stamp = between;
        y.wheel_left = speed(0) + 0.001 * static_cast<double>(tick % 7);
        y.wheel_right = speed(1);
        y.yaw_rate = body(kYaw);
        loop->receiveWheels({y, FrozenSource::Sample::Constant(between)}, between);
        loop->observe(y, between);
      }
      if (tick % 130 == 0) loop->setSetPoint({0.3, 0.0, 0.1 * static_cast<double>(tick % 3)}, between);
      if (tick % 50 == 33) loop->applied(command, AppliedSource::drive, between);
      if (tick == 2011) loop->freezeLearning(true, between);
      if (tick == 3017) loop->freezeLearning(false, between);
      if (tick == 4013) {
        if (const auto* gains = std::get_if<ControllerParameters>(&parameters.controller)) {
          ControllerParameters other = *gains;
          other.kappa_a *= 0.9;
          loop->adoptGains(other, between);
        }
      }
    }
  }
  EXPECT_GT(commands, 290);
  EXPECT_GT(command.left, 1.0) << "it drives";
}

TEST(DriveLoopWithoutBeliefTimer, DoesTheSameToTheBit) {
  for (DriveParameters parameters : {thesis(), predictive()}) {
    if (!parameters.plant_model) parameters.plant_model = PlantModel{};
    for (const bool shared : {false, true}) {
      parameters.motors_shared = shared;
      expectSameWithoutBeliefTimer(parameters);
    }
  }
}

/// Drives by a timer that is set as the loop asks for.
TEST_F(DriveLoopTest, TimerIsSetToRightAfterTheMeasurements) {
  drive(0.1, "");
  double due = now + kPeriod;
  std::vector<double> ages;
  double measured = 0.0;
  for (long end = tick + 4000; tick < end; ++tick) {
    now = start + kTick * static_cast<double>(tick);
    if (tick % 20 == 5) loop.observe(sample(), measured = now);
    if (now < due) continue;
    if (loop.advance(now, due)) ages.push_back(now - measured);
    due = loop.nextDue(due, now);
    ASSERT_GE(due, now + 0.95 * kPeriod - kTick);
  }
  ASSERT_GE(ages.size(), 195u);
  EXPECT_LE(*std::max_element(ages.begin() + 5, ages.end()), 1.5 * kTick);
  loop.start({}, now);
  EXPECT_NEAR(loop.nextDue(now, now), now + kPeriod, 1e-6) << "a start forgets the measurements";
}

TEST_F(PredictiveDriveLoopTest, DrivesToTheSetPoint) {
  drive(3.0);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
  EXPECT_NEAR(0.098 * speed.mean(), 0.5, 0.02);
  EXPECT_EQ(loop.status().faults_detected, 0u);
}

TEST_F(DriveLoopTest, WaitsForMeasurementsAndASetPoint) {
  drive(0.2, "");
  EXPECT_EQ(status(), DriveStatus::idle);
  drive(0.2, "s");
  EXPECT_EQ(status(), DriveStatus::stopped);
  EXPECT_EQ(why(), "no wheel speeds received yet");
  drive(0.2);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
}

TEST_F(DriveLoopTest, PairsAloneAreEnough) {
  drive(1.0, "ps");
  EXPECT_EQ(status(), DriveStatus::driving) << why();
}

TEST_F(DriveLoopTest, TheWheelsAreObservedAloneWhileTheImuIsSilent) {
  drive(2.0);
  drive(2.0, "ws");
  EXPECT_EQ(status(), DriveStatus::driving) << why();
  EXPECT_EQ(why(), "yaw rate lost");
  EXPECT_NEAR(0.098 * speed.mean(), 0.5, 0.05) << "it follows the wheels";
  drive(1.0);
  EXPECT_EQ(why(), "") << "it is back";
  EXPECT_EQ(loop.status().rejected_measurements, 0u) << "a pair whose wheels were taken alone is no reason to complain";
}

/// Two sources of one topic, or a bridge that sends what it held back.
TEST_F(DriveLoopTest, WheelMessagesCloseTogetherDisturbNothing) {
  drive(2.0);
  double fastest = 0.0, slowest = HUGE_VAL;
  for (int k = 0; k < 250; ++k) {
    drive(kPeriod, "wts");
    fastest = std::max({fastest, command.left, command.right});
    slowest = std::min({slowest, command.left, command.right});
  }
  EXPECT_EQ(status(), DriveStatus::driving) << why();
  EXPECT_NEAR(0.098 * fastest, 0.5, 0.05);
  EXPECT_NEAR(0.098 * slowest, 0.5, 0.05);
}

TEST_F(DriveLoopTest, AnImuWithThePeriodOfItsDeadlineIsNoReasonToBrake) {
  drive(2.0);
  for (int k = 0; k < 500; ++k) {
    drive(kPeriod, "w5s");
    ASSERT_EQ(status(), DriveStatus::driving) << why();
  }
}

TEST_F(DriveLoopTest, AnImuThatFallsSilentAfterAPairIsLostAndNotUnpaired) {
  drive(2.0);
  Observation last = sample();  // of an IMU that is faster than the wheels
  last.valid.wheel_left = last.valid.wheel_right = false;
  loop.receiveImu({last, FrozenSource::Sample::Constant(now)}, now);
  for (int k = 0; k < 50; ++k) {
    drive(kPeriod, "ws");
    ASSERT_EQ(status(), DriveStatus::driving) << why();
  }
}

TEST_F(DriveLoopTest, AnImuThatIsSlowerThanItsDeadlineIsLostOnce) {
  drive(2.0);
  int changes = 0;
  std::string before = why();
  const auto count = [&](const std::string& sources) {
    for (int k = 0; k < 500; ++k) {
      drive(kPeriod, sources);
      if (why() != before) ++changes;
      before = why();
    }
  };
  count("w4s");
  EXPECT_EQ(before, "yaw rate lost");
  EXPECT_EQ(changes, 1);
  EXPECT_EQ(loop.status().rejected_measurements, 0u) << "its pairs, of wheels that were observed alone";
  count("wips");
  EXPECT_EQ(before, "");
  EXPECT_EQ(changes, 2);
}

TEST_F(PredictiveDriveLoopTest, ASampleStampedAheadOfTheClockIsRefusedAndTheNextOneIsHeard) {
  drive(2.0);
  Observation ahead = sample();
  ahead.stamp += 100.0;
  EXPECT_FALSE(loop.observe(ahead, now));
  loop.receiveWheels({ahead, FrozenSource::Sample::Constant(now)}, now);
  loop.receiveImu({ahead, FrozenSource::Sample::Constant(now)}, now);
  EXPECT_EQ(loop.status().rejected_measurements, 3u);
  drive(1.0);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
  EXPECT_EQ(why(), "");
  EXPECT_EQ(loop.status().brakes, 0u);
  EXPECT_EQ(loop.status().rejected_measurements, 3u);
  EXPECT_NEAR(loop.predictive()->measurement().stamp, now, 0.021);
}

TEST_F(DriveLoopTest, StopsWithoutWheelsAndNamesThem) {
  drive(2.0);
  drive(2.0, "is");
  EXPECT_EQ(status(), DriveStatus::stopped);
  EXPECT_EQ(why(), "wheel speeds too old");
  EXPECT_EQ(command, WheelCommand{});
}

TEST_F(DriveLoopTest, StopsWithoutASetPoint) {
  drive(2.0);
  drive(2.0, "wip");
  EXPECT_EQ(why(), "set point too old");
  EXPECT_EQ(command, WheelCommand{});
}

TEST_F(DriveLoopTest, AnEmergencyStopBrakesAndWaitsForAZeroSetPoint) {
  drive(2.0);
  robot.emergency_stop = true;
  drive(1.0);
  EXPECT_EQ(status(), DriveStatus::stopped);
  EXPECT_EQ(why(), "emergency stop");
  robot.emergency_stop = false;
  drive(1.0);
  EXPECT_EQ(status(), DriveStatus::stopped) << "the set point was meant for a robot that could drive";
  set_point = {};
  drive(0.2);
  set_point = {0.5, 0.0, 0.0};
  drive(2.0);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
  EXPECT_EQ(loop.status().brakes, 1u);
}

TEST_F(DriveLoopTest, ASourceThatRepeatsItselfStops) {
  drive(2.0);
  for (int i = 0; i < 30 && status() == DriveStatus::driving; ++i) {
    Observation wheels = sample();
    wheels.valid.yaw_rate = wheels.valid.acceleration = false;
    loop.receiveWheels({wheels, FrozenSource::Sample::Ones()}, now);
    drive(kPeriod, "ips");
  }
  EXPECT_EQ(status(), DriveStatus::braking);
  EXPECT_EQ(why(), "wheel speeds frozen");
}

TEST_F(DriveLoopTest, WheelSpeedsThatMayRepeatAreNotFrozen) {
  drive(2.0);
  for (int i = 0; i < 50; ++i) {
    Observation wheels = sample();
    wheels.valid.yaw_rate = wheels.valid.acceleration = false;
    loop.receiveWheels({wheels, FrozenSource::Sample::Ones(), true}, now);
    drive(kPeriod, "ips");
    ASSERT_EQ(status(), DriveStatus::driving) << why();
  }
}

TEST_F(DriveLoopTest, RefusesSetPointsThatNobodyCanHaveMeant) {
  EXPECT_EQ(loop.setSetPoint({std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0}, now), SetPointVerdict::not_finite);
  EXPECT_EQ(loop.setSetPoint({1e9, 0.0, 0.0}, now), SetPointVerdict::absurd);
  EXPECT_EQ(loop.setSetPoint({50.0, 0.0, 0.0}, now), SetPointVerdict::accepted);
  EXPECT_EQ(loop.setPoint().forward, 2.0) << "scaled into the limits";
  EXPECT_EQ(loop.status().rejected_set_points, 2u);
}

TEST_F(DriveLoopTest, CountsSetPointsBeyondTheLimitsAndTellsTheLast) {
  loop.setSetPoint({2.0, 0.0, 0.0}, now);
  loop.setSetPoint({-0.5, 0.0, 0.7}, now);
  EXPECT_EQ(loop.status().scaled_set_points, 0u);
  loop.setSetPoint({4.0, 0.0, 2.0}, now);
  loop.setSetPoint({0.0, 0.0, 9.0}, now);
  loop.setSetPoint({1.0, 0.0, 0.0}, now);
  EXPECT_EQ(loop.status().scaled_set_points, 2u);
  EXPECT_EQ(loop.status().scaled_from.yaw_rate, 9.0);
  EXPECT_EQ(loop.status().scaled_to.yaw_rate, 4.0);
}

TEST_F(DriveLoopTest, DisabledItStandsUntilAZeroSetPoint) {
  drive(2.0);
  robot.disabled = true;
  drive(1.0);
  EXPECT_EQ(status(), DriveStatus::stopped);
  EXPECT_EQ(why(), "disabled");
  EXPECT_EQ(loop.command(), WheelCommand{});
  robot.disabled = false;
  drive(1.0);
  EXPECT_EQ(status(), DriveStatus::stopped) << "the set point that goes on was meant for a robot that could drive";
}

TEST_F(DriveLoopTest, AClockThatJumpsBackBrakesAndStartsAnew) {
  drive(2.0);
  const double fast = command.left;
  start -= 100.0;
  drive(0.022);
  EXPECT_EQ(loop.status().clock_resets, 1u);
  EXPECT_EQ(status(), DriveStatus::braking);
  EXPECT_LT(command.left, fast);
  drive(3.0);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
}

TEST_F(PredictiveDriveLoopTest, AClockThatJumpsBackForgetsNothingThatWasLearned) {
  DriveParameters parameters = predictive();
  auto controller = makeController(parameters);
  auto& inside = dynamic_cast<PredictiveController&>(*controller);
  DriveLoop other(parameters, std::move(controller));
  inside.setLearned({{0.6, 1.0}});
  other.advance(10.0);
  other.advance(5.0);
  EXPECT_EQ(other.status().clock_resets, 1u);
  EXPECT_EQ(inside.learned().slip.effective_track, 0.6);
}

TEST_F(PredictiveDriveLoopTest, ReleasedItGoesOnFromTheSpeedThatSomebodyElseDrove) {
  drive(1.0, "");
  speed.setConstant(6.0);
  loop.start(WheelCommand::from(speed), now);
  loop.release();
  tick = 0;
  start = now + kTick;
  double least = 6.0, largest_change = 0.0;
  WheelCommand before = WheelCommand::from(speed);
  command = before;
  for (int i = 0; i < 100; ++i) {
    drive(kPeriod);
    least = std::min(least, 0.5 * (command.left + command.right));
    largest_change = std::max(largest_change, (command.vector() - before.vector()).cwiseAbs().maxCoeff());
    before = command;
  }
  EXPECT_GT(least, 4.0) << "no brake to rest in between";
  EXPECT_LE(largest_change, 20.0 * kPeriod / 0.098 + 1e-9);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
  EXPECT_EQ(loop.status().clock_resets, 0u);
}

TEST_F(DriveLoopTest, StartingAnewForgetsTheSetPoint) {
  drive(2.0);
  loop.start({}, now);
  EXPECT_EQ(loop.command(), WheelCommand{});
  drive(1.0, "wip");
  EXPECT_EQ(status(), DriveStatus::idle) << why();
  EXPECT_EQ(command, WheelCommand{});
}

TEST_F(DriveLoopTest, AStallIsCountedAndNothingJumps) {
  drive(2.0);
  const WheelCommand before = command;
  start += 0.5;
  drive(kPeriod);
  EXPECT_GT(loop.status().dropped_periods, 10u);
  // The clock may have jumped.
  EXPECT_LE((command.vector() - before.vector()).cwiseAbs().maxCoeff(), 20.0 * 1.25 * kPeriod / 0.098);
  drive(1.0);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
}

TEST_F(DriveLoopTest, AnotherPublisherIsAFaultWithItsName) {
  drive(2.0);
  robot.contended = true;
  drive(2.0);
  EXPECT_EQ(status(), DriveStatus::faulted);
  EXPECT_EQ(reason(loop.status(), "/teleop on /cmd_drive"), "another node publishes commands: /teleop on /cmd_drive");
  EXPECT_EQ(loop.status().faults, 1u);
}

TEST_F(PredictiveDriveLoopTest, ADeadEncoderIsExcludedAndNamed) {
  drive(3.0);
  for (int i = 0; i < 100; ++i) {
    drive(kPeriod, "s");
    Observation y = sample();
    y.wheel_left = 0.0;
    loop.observe(y, now);
  }
  EXPECT_EQ(loop.status().fault, Fault::left_encoder_wrong);
  EXPECT_EQ(why(), "left encoder wrong");
  EXPECT_EQ(status(), DriveStatus::driving);
  EXPECT_EQ(loop.status().faults_detected, 1u);
}

DriveParameters baseline(bool monitored) {
  DriveParameters parameters = predictive();
  parameters.controller = DifferentialDriveParameters{};
  parameters.open_loop_monitored = monitored;
  return parameters;
}

class BaselineDriveLoopTest : public DriveLoopTest {
 protected:
  BaselineDriveLoopTest() : DriveLoopTest(baseline(true)) {}
};

TEST_F(BaselineDriveLoopTest, ADeadEncoderIsToldOfTheMonitoredBaselineAndStopsNothing) {
  drive(2.0);
  ASSERT_NE(loop.faultReport(), nullptr);
  EXPECT_FALSE(loop.faultReport()->faulty());
  for (int i = 0; i < 100; ++i) {
    drive(kPeriod, "s");
    Observation y = sample();
    y.wheel_left = 0.0;
    loop.observe(y, now);
  }
  EXPECT_STREQ(loop.faultReport()->reason(), "left encoder wrong");
  EXPECT_EQ(loop.status().fault, Fault::left_encoder_wrong);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
  EXPECT_GT(command.left, 4.0);
}

TEST(DriveLoop, TheBaselineIsMonitoredOnlyWhenAsked) {
  const DriveParameters parameters = baseline(false);
  EXPECT_EQ(DriveLoop(parameters, makeController(parameters)).faultReport(), nullptr);
}

TEST(DriveLoop, ThePredictiveStructureNeedsAPlantModel) {
  DriveParameters parameters;
  parameters.controller = PredictiveParameters{};
  EXPECT_THROW(makeController(parameters), ParameterError);
}

TEST(DriveLoop, ThePhaseOfTheCallsDoesNotMatter) {
  // The belief timer and the action timer in any order give the same commands.
  std::array<double, 2> speeds{};
  for (int order = 0; order < 2; ++order) {
    DriveLoop loop(thesis(), makeController(thesis()));
    loop.release();
    for (int i = 0; i <= 400; ++i) {
      const double now = kTick * i;
      loop.setSetPoint({0.5, 0.0, 0.0}, now);
      if (i % 20 == 7) {
        Observation y;
        y.stamp = now;
        loop.observe(y, now);
      }
      if (order == 0) loop.updateBelief(now);
      if (i % 20 == 0) loop.advance(now);
      if (order == 1 && i % 3 != 0) loop.updateBelief(now);
    }
    speeds[static_cast<std::size_t>(order)] = loop.command().left;
  }
  EXPECT_GT(speeds[0], 0.0);
  EXPECT_EQ(speeds[0], speeds[1]);
}

TEST_F(PredictiveDriveLoopTest, WhatItWasToldDrivesAnotherLoopToTheSameBits) {
  std::vector<DriveInput> heard;
  std::vector<WheelCommand> driven;
  loop.listen([&](const DriveInput& input) {
    heard.push_back(input);
    if (std::holds_alternative<ActionInput>(input.what)) driven.push_back(loop.command());
  });
  loop.setLearned({{0.5, 0.95}}, start);
  drive(1.0);
  set_point = {0.3, 0.0, 0.4};
  drive(1.0, "ws");  // the IMU falls silent: the wheels are observed by the loop itself
  loop.freezeLearning(true, now);
  PredictiveParameters gains;
  gains.reference_time *= 2.0;
  loop.adoptGains(gains, now);
  loop.receiveFeedback(now, now);
  robot.emergency_stop = true;
  drive(0.5);
  robot.emergency_stop = false;
  start -= 1.0;  // the clock runs back
  drive(0.5);
  loop.start({1.0, 1.0}, now);
  drive(0.5);
  set_point = {-0.3, 0.0, 0.0};
  drive(0.021);
  loop.advance(now + 0.02, now + 0.02);  // an action that was due at a time of its own
  ASSERT_GT(driven.size(), 150u);

  DriveLoop again(predictive(), makeController(predictive()));
  again.release();
  std::size_t actions = 0, different = 0;
  for (const DriveInput& input : heard) {
    if (std::holds_alternative<ActionInput>(input.what) && again.command() != driven.at(actions++)) ++different;
    again.take(input);
  }
  EXPECT_EQ(actions, driven.size());
  EXPECT_EQ(different, 0u);
  EXPECT_EQ(again.command(), loop.command());
  EXPECT_EQ(again.controller().freeEnergy(), loop.controller().freeEnergy());
  EXPECT_EQ(again.status().clock_resets, 1u);
  EXPECT_EQ(again.status().brakes, loop.status().brakes);
  EXPECT_TRUE(dynamic_cast<const PredictiveController&>(again.controller()).learningFrozen());
}

TEST_F(PredictiveDriveLoopTest, WhatItIsToldToHaveLearnedIsWhatItsControllerKnows) {
  loop.setLearned({{0.6, 1.0}}, start);
  EXPECT_EQ(dynamic_cast<const PredictiveController&>(loop.controller()).learned().slip.effective_track, 0.6);
}

TEST_F(DriveLoopTest, ASetPointThatWasSentLongAgoIsLate) {
  drive(1.0);
  ASSERT_EQ(status(), DriveStatus::driving) << why();
  for (int i = 0; i < 5; ++i) {
    loop.setSetPoint(set_point, now, now - 10.0);
    drive(0.02, "wip");
  }
  EXPECT_EQ(status(), DriveStatus::braking) << why();
  EXPECT_EQ(why(), "set point too old");
  loop.setSetPoint(set_point, now, now);
  drive(0.3, "wip");
  EXPECT_EQ(status(), DriveStatus::driving) << why();
}

TEST_F(DriveLoopTest, TwoWhoSendSetPointsStopTheRobotUntilOneIsGone) {
  drive(1.0);
  robot.rivals = true;
  drive(0.1);
  EXPECT_EQ(status(), DriveStatus::braking);
  EXPECT_EQ(reason(loop.status(), "/a and /b on /set_point"),
            "more than one node publishes set points: /a and /b on /set_point");
  drive(1.0);
  EXPECT_EQ(loop.command(), WheelCommand{});
  robot.rivals = false;
  drive(0.1);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
}

TEST_F(DriveLoopTest, GainsOfAnotherStructureAreRefused) {
  EXPECT_THROW(loop.adoptGains(PredictiveParameters{}, now), ParameterError);
  EXPECT_NO_THROW(loop.adoptGains(ControllerParameters{}, now));
}

}  // namespace
}  // namespace jackal_aic
