#include "jackal_aic/faults/fault_monitor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>

#include "jackal_aic/predictive/wheel_controller.hpp"
#include "watched_robot.hpp"

/// @file
/// What the monitor reports, by which name, and what is no fault.

namespace jackal_aic {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// ---- names

TEST(FaultMonitor, ARemarkOnAnAssumedModelTellsWhatShareIsReached) {
  for (const double scale : {0.5, 1.9}) {
    Robot robot({}, assumedModel());
    const FaultReport& report =
        robot.drive(kStraight, 75, [=](Observation& y) { y.wheel_left *= scale, y.wheel_right *= scale; });
    ASSERT_TRUE(report.wheels_off_model) << scale << " " << report.reason();
    EXPECT_NEAR(report.wheel_share, scale, 0.05);
  }
  for (const double scale : {0.4, 1.8}) {
    Robot robot({}, assumedModel());
    const FaultReport& report = robot.drive(kTurn, 75, [=](Observation& y) { y.yaw_rate *= scale; });
    ASSERT_TRUE(report.turn_off_model) << scale << " " << report.reason();
    EXPECT_NEAR(report.turn_share, scale, 0.05);
  }
}

TEST(FaultText, OfARemarkHasItsNumber) {
  EXPECT_EQ(text(Fault::wheels_off_model, 0.496), "wheels reach 50 % of their commands");
  EXPECT_EQ(text(Fault::wheels_off_model, -1.0), "wheels reach -100 % of their commands");
  EXPECT_EQ(text(Fault::wheels_off_model, std::numeric_limits<double>::infinity()),
            "wheels reach 999 % of their commands");
  EXPECT_EQ(text(Fault::turn_off_model, 1.8), "robot reaches 180 % of the yaw rate of its wheels");
  EXPECT_EQ(text(Fault::stuck, 0.5), text(Fault::stuck)) << "no number";
}

TEST(FaultMonitor, TellsWhichSideAndWhyAndWhatCounts) {
  constexpr double kStops = 5.0 * kPerWheel;  // yaw rate when one wheel stands
  constexpr ChannelValidity kAll{}, kNoLeft{true, false, true, true}, kNoRight{true, true, false, true},
      kNoGyro{false, true, true, true}, kNoAccelerometer{true, true, true, false}, kNoImu{false, true, true, false};
  const struct {
    std::function<void(Observation&)> fault;
    const char* reason;
    ChannelValidity valid;
  } rows[] = {{[](Observation& y) { y.wheel_left = 5.01; }, "left encoder frozen", kNoLeft},
              {[](Observation& y) { y.wheel_right = 5.01; }, "right encoder frozen", kNoRight},
              {[](Observation& y) { y.wheel_left += 2.0; }, "left encoder wrong", kNoLeft},
              {[](Observation& y) { y.wheel_right -= 2.0; }, "right encoder wrong", kNoRight},
              {[](Observation& y) { y.yaw_rate += 0.2; }, "gyro disagrees with the wheels", kNoGyro},
              {[](Observation& y) { y.yaw_rate = 0.001; }, "gyro frozen", kNoGyro},
              {[](Observation& y) { y.acceleration_z = -9.8; }, "IMU upside down", kNoImu},
              {[](Observation& y) { y.acceleration_x += 8.0; }, "accelerometer wrong", kNoAccelerometer},
              {[](Observation& y) { y.wheel_left = 0.0, y.yaw_rate += kStops; },
               "left wheels do not follow their command", kAll},
              {[](Observation& y) { y.wheel_right = 0.0, y.yaw_rate -= kStops; },
               "right wheels do not follow their command", kAll},
              {[](Observation& y) { y.wheel_left = y.wheel_right = 0.0; }, "wheels do not follow their command", kAll}};
  for (const auto& row : rows) {
    Robot robot;
    robot.drive(kStraight, 3 * kSecond);
    EXPECT_STREQ(robot.drive(kStraight, 15, row.fault).reason(), row.reason);
    EXPECT_EQ(robot.monitor.report().valid(), row.valid) << row.reason;
  }
}

TEST(FaultMonitor, AGyroThatIsFrozenAtZeroIsFoundWhenTheRobotShouldTurn) {
  const auto freeze = [](Observation& y) { y.yaw_rate = 0.0; };
  for (const PlantModel& plant : {model(), assumedModel()}) {
    const int in_time = plant.identified ? 55 : 70;  // samples; a drive train may be slow, and reverses its wheels
    for (const WheelCommand& turn : {kTurn, WheelCommand{1.4, -1.4}, WheelCommand{4.0, 6.0}, WheelCommand{2.0, -2.0}}) {
      for (const bool turned_before : {true, false}) {
        for (const WheelCommand& before : {kStand, kStraight}) {
          SCOPED_TRACE("to " + std::to_string(turn.left) + " and " + std::to_string(turn.right) + " rad/s");
          Robot robot({}, plant);
          robot.drive(turned_before ? kTurn : kStraight, 3 * kSecond);
          robot.drive(before, 2 * kSecond);
          EXPECT_FALSE(robot.drive(before, 2 * kSecond, freeze).faulty()) << "reads what it should";
          EXPECT_STREQ(robot.drive(turn, in_time, freeze).reason(), "gyro frozen");
          EXPECT_STREQ(robot.drive(before, 3 * kSecond, freeze).reason(), "gyro frozen") << "at any reading";
          EXPECT_FALSE(robot.drive(turn, 5 * kSecond).faulty()) << "it lives again";
        }
      }
    }
  }
}

TEST(FaultMonitor, GyroOfTheWrongSignIsToldAndStaysOutUntilItsDriverRestarts) {
  Robot robot;
  const auto flip = [](Observation& y) { y.yaw_rate = -y.yaw_rate; };
  robot.drive(kStraight, 3 * kSecond, flip);
  EXPECT_FALSE(robot.monitor.report().faulty()) << "a straight line does not tell the sign";
  EXPECT_STREQ(robot.drive(kTurn, 60, flip).reason(), "gyro turns against the wheels: mounted upside down?");
  for (const WheelCommand& command : {kStraight, kStand, kTurn, WheelCommand{-3.0, 4.0}, kStraight}) {
    const FaultReport& report = robot.drive(command, 5 * kSecond, flip);
    EXPECT_FALSE(report.valid().yaw_rate) << "it agrees with the wheels where they do not turn the robot";
    EXPECT_EQ(report.fault(), Fault::gyro_reversed);
  }
  EXPECT_FALSE(robot.drive(kTurn, 12 * kSecond).faulty()) << "turned over, it counts again";
  Robot another;
  another.drive(kTurn, 3 * kSecond, flip);
  ASSERT_EQ(another.monitor.report().fault(), Fault::gyro_reversed);
  another.monitor.restart();
  EXPECT_FALSE(another.drive(kStraight, 25).faulty()) << "a driver that restarted may have another sign";
}

TEST(FaultMonitor, AWheelThatIsSlowedDownAndTurnsOnIsNotBlocked) {
  const auto slowedTo = [](double part, bool gyro = true) {
    return [part, gyro](Observation& y) {
      const double off = (part - 1.0) * y.wheel_right;
      y.wheel_right += off, y.yaw_rate += kPerWheel * off;
      y.valid.yaw_rate = gyro;
    };
  };
  constexpr const char* kBlocked = "right wheels do not follow their command";
  Robot slow;
  slow.drive(kStraight, 3 * kSecond);
  Robot weak = slow, alone = slow;
  EXPECT_STREQ(slow.drive(kStraight, 3 * kSecond, slowedTo(0.6)).reason(), "");
  EXPECT_TRUE(slow.monitor.report().valid().all()) << "what it measures counts";
  EXPECT_STREQ(slow.drive(kStraight, 15, slowedTo(0.0)).reason(), kBlocked);
  EXPECT_STREQ(weak.drive(kStraight, 15, slowedTo(0.4)).reason(), kBlocked);
  // Without a gyro it is as well an encoder that is wrong.
  EXPECT_STREQ(alone.drive(kStraight, 9, slowedTo(0.6, false)).reason(), "");
  EXPECT_STREQ(alone.drive(kStraight, 2 * kSecond, slowedTo(1.0, false)).reason(), "");
  EXPECT_STREQ(alone.drive(kStraight, 9, slowedTo(0.6, false)).reason(), "") << "what is over is forgotten";
  EXPECT_STREQ(alone.drive(kStraight, 6, slowedTo(0.6, false)).reason(), kBlocked);
}

/// A load may slow a wheel at once, and for long.
TEST(FaultMonitor, AWheelThatALoadSlowsDownAtOnceIsBelievedAgain) {
  for (const PlantModel& told : {model(), assumedModel()}) {
    Robot robot({}, told);
    robot.drive(kStraight, 3 * kSecond);
    const auto slows = [](Observation& y) {
      const double off = -0.45 * y.wheel_right;
      y.wheel_right += off, y.yaw_rate += kPerWheel * off;
    };
    EXPECT_FALSE(robot.drive(kStraight, 20 * kSecond, slows).faulty()) << told.identified;
    const FaultReport& later = robot.drive(kStraight, kSecond, [&](Observation& y) {
      slows(y);
      y.yaw_rate += 1.0;
    });
    EXPECT_EQ(later.fault(), Fault::gyro_disagrees) << told.identified << ": the wheels judge the gyro again";
  }
}

TEST(FaultMonitor, WheelsThatAreToStandAndTurnAreMoved) {
  const struct {
    const char* how;
    double left, right, yaw_rate;
  } pushes[] = {{"pushed straight", 2.0, 5.0, 0.0},
                {"turned with the wheels on the ground", 2.0, 5.0, 1.5},
                {"spun in the air", 2.0, 5.0, -0.7},
                {"one wheel by hand", 3.0, 0.0, 0.0},
                {"one wheel by hand", 0.0, 3.0, 0.0}};
  for (const auto& row : pushes) {
    SCOPED_TRACE(row.how);
    Robot robot;
    robot.drive(kStraight, 3 * kSecond);
    constexpr WheelCommand kNearlyRest{0.02, -0.01};  // a controller's command is hardly ever zero
    robot.drive(kNearlyRest, 3 * kSecond);
    const auto push = [&](Observation& y) {
      y.wheel_left += row.left, y.wheel_right += row.right, y.yaw_rate += row.yaw_rate;
    };
    const FaultReport& pushed = robot.drive(kNearlyRest, 10, push);
    EXPECT_STREQ(pushed.reason(), "moved from outside");
    EXPECT_FALSE(pushed.faulty());
    EXPECT_FALSE(pushed.valid().wheel_left || pushed.valid().wheel_right) << "the controller is not to fight it";
    const WheelCommand fights{row.left > 2.0 ? -4.0 : 0.0, row.right == 3.0 ? -4.0 : 0.0};
    EXPECT_STREQ(robot.drive(fights, 10, push).reason(), "moved from outside") << "after it began to";
    EXPECT_STREQ(robot.drive(kNearlyRest, 4 * kSecond, push).reason(), "moved from outside");
    robot.drive(kStand, 75);
    EXPECT_TRUE(robot.monitor.report().valid().all());
    EXPECT_STREQ(robot.drive(kStraight, 2 * kSecond).reason(), "") << "nothing is left of it";
    EXPECT_STREQ(robot.drive(kStraight, 15, [](Observation& y) { y.wheel_left = y.wheel_right = 0.0; }).reason(),
                 "wheels do not follow their command");
  }
}

TEST(FaultMonitor, WheelsThatCoastWhileTheirCommandRisesAreTold) {
  const PlantModel quick = changed(model(), [](PlantModel& m) { m.lag = 0.03, m.acceleration_limit = 10.0; });
  for (const double deceleration : {1.5, 2.0, 4.0}) {  // rad/s^2
    Robot robot({}, quick);
    robot.noise = 0.3;
    WheelController wheel(PredictiveParameters{}, quick, kRadius);
    double told = HUGE_VAL;
    for (int k = 0; k < 8 * kSecond; ++k) {
      const double off = kPeriod * (k - 4 * kSecond);  // s without power
      const auto coast = [&](Observation& y) {
        if (off > 0.0) y.wheel_left = y.wheel_right = std::max(0.0, 5.0 - deceleration * off) + 0.001 * (k % 7);
        if (off > 0.0) y.acceleration_x = y.wheel_left > 0.1 ? -kRadius * deceleration : 0.0;
        wheel.correct(y.wheel_left);
      };
      if (isFault(robot.drive({wheel.action(), wheel.action()}, 1, coast).fault())) told = std::min(told, off);
      wheel.act(wheel.input(5.0));
      for (int step = 0; step < 20; ++step) wheel.predict();
    }
    EXPECT_GT(told, 0.0) << deceleration;
    // Half of 5 rad/s is lost by then, and half a second is over.
    EXPECT_LT(told, 2.5 / deceleration + 0.8) << deceleration;
    EXPECT_EQ(robot.monitor.report().fault(), Fault::wheels_blocked) << deceleration;
  }
}

// ---- what is no fault

/// A driver that publishes zero for every small rate: at rest, on a straight line and in between.
TEST(FaultMonitor, AGyroWithADeadZoneIsNotFrozen) {
  for (const double dead_zone : {0.005, 0.01, 0.03, 0.05}) {
    Robot robot;
    int zeros = 0;
    const auto cut = [&](Observation& y) {
      EXPECT_FALSE(robot.monitor.report().faulty())
          << robot.monitor.report().reason() << ", " << dead_zone << " rad/s, at " << y.stamp << " s";
      if (std::abs(y.yaw_rate) >= dead_zone) return;
      y.yaw_rate = 0.0;
      ++zeros;
    };
    for (const WheelCommand& command : {kStand, kTurn, kStraight, kStand, kStraight, kTurn, WheelCommand{4.9, 5.1},
                                        WheelCommand{-3.0, 4.0}, kStraight, kStand}) {
      robot.drive(command, 3 * kSecond, cut);
    }
    EXPECT_GT(zeros, 400);
  }
}

TEST(FaultMonitor, VibrationOfARealRobotIsNoFaultAndBlindsNobody) {
  // A Husky on asphalt at 1 m/s: 2.07, 2.69 and 0.93 m/s^2 and 0.019 rad/s; it grows with the speed.
  for (const double scale : {0.3, 1.0, 1.5}) {
    Robot robot;
    std::mt19937 random(17);
    std::normal_distribution<double> unit(0.0, 1.0);
    const auto vibrate = [&](Observation& y) {
      const double speed = scale * kRadius * 0.5 * std::abs(y.wheel_left + y.wheel_right);
      y.acceleration_x += 2.07 * speed * unit(random);
      y.acceleration_y += 2.69 * speed * unit(random);
      *y.acceleration_z += 0.93 * speed * unit(random);
      y.yaw_rate += 0.019 * speed * unit(random);
    };
    int samples = 0, without_accelerometer = 0;
    for (int lap = 0; lap < 10; ++lap) {
      for (const WheelCommand& command : {kFast, WheelCommand{5.0, 8.0}, kStand}) {
        for (int i = 0; i < 4 * kSecond; ++i, ++samples) {
          const FaultReport& report = robot.drive(command, 1, vibrate);
          ASSERT_FALSE(isFault(report.fault())) << report.reason() << ", scale " << scale << ", lap " << lap;
          without_accelerometer += report.valid().acceleration ? 0 : 1;
        }
      }
    }
    EXPECT_LT(without_accelerometer, samples / 50) << scale;
    robot.drive(kFast, 4 * kSecond, vibrate);
    const auto blocked = [&](Observation& y) {
      vibrate(y);
      y.yaw_rate += kPerWheel * y.wheel_left;
      y.wheel_left = 0.0;
    };
    EXPECT_STREQ(robot.drive(kFast, 25, blocked).reason(), "left wheels do not follow their command") << scale;
  }
}

TEST(FaultMonitor, SamplesThatAreNoneChangeNothing) {
  Robot robot;
  robot.drive(kStraight, 3 * kSecond);
  Observation broken = robot.sample(), stale = broken;
  broken.wheel_left = kNan;
  stale.stamp = 1.0;
  stale.wheel_left = 0.0;
  for (const Observation& none : {broken, stale}) {
    for (int k = 0; k < 20; ++k) EXPECT_FALSE(robot.monitor.check(none).faulty());
  }
}

TEST(FaultMonitor, WhereNobodyTellsTheCommandsAWheelGoesOnAsItWasAndFreezes) {
  for (const double gain : {1.0, 0.8}) {
    Robot robot({}, changed(model(), [gain](PlantModel& m) { m.gain = gain; }));
    robot.known = false;
    ASSERT_FALSE(robot.drive(kFast, 400).faulty());
    Robot lost = robot;
    EXPECT_STREQ(robot.drive(kFast, 20, [=](Observation& y) { y.wheel_left = 10.0 * gain; }).reason(),
                 "left encoder frozen")
        << gain;
    for (int k = 0; k < 200; ++k) {
      lost.drive(kFast, 1, [](Observation& y) { y.valid.wheel_left = false; });
      ASSERT_LT(lost.monitor.report().gyro.probability, 0.1) << k;
    }
  }
}

/// A robot of 400 kg that is asked to turn faster than its motors can: its wheels stay behind their prediction for
/// seconds, and turn the body as they are measured.
TEST(FaultMonitor, ATurnThatTheMotorsCannotFollowIsNoFaultOfTheEncoders) {
  PlantModel heavy;
  heavy.dead_time = 0.2;
  heavy.lag = 0.047;
  heavy.gain = 0.948;
  heavy.acceleration_limit = 1.56;
  heavy.effective_track = 1.852;
  GeometryParameters geometry;
  geometry.wheel_radius = 0.2;
  FaultMonitor monitor({}, geometry, heavy);
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 1.0);
  double speed = 0.0;
  for (long k = 0; k < 8000; ++k) {
    const double time = 0.001 * static_cast<double>(k);
    const auto ramp = [time](double from) { return std::clamp(8.2 * (time - from), 0.0, 13.4); };
    const double wanted = std::min(ramp(2.2), 6.8);  // rad/s, all that the torque of the motors makes of it
    speed += (wanted - speed) * 0.001 / (wanted < 6.8 ? 0.05 : 0.45);
    if (k % 10 == 0) {
      Observation y;
      y.stamp = time;
      y.wheel_left = -speed + 0.01 * noise(random);
      y.wheel_right = speed + 0.01 * noise(random);
      y.yaw_rate = 0.4 * speed / 1.852 + 0.005 * noise(random);
      y.acceleration_x = 0.05 * noise(random);
      y.acceleration_z = kGravity;
      ASSERT_FALSE(monitor.check(y).faulty()) << monitor.report().reason() << " at " << time << " s";
    }
    monitor.advance(WheelCommand{-ramp(2.0), ramp(2.0)}, 0.001);
  }
}

TEST(FaultMonitor, AnotherAccelerationLimitIsNoFault) {
  for (double ratio : {0.5, 1.8, 3.0}) {
    Robot robot({}, model(), changed(model(), [ratio](PlantModel& m) { m.acceleration_limit *= ratio; }));
    std::mt19937 random(8);
    std::normal_distribution<double> speed(0.0, 12.0);
    WheelCommand command;
    for (int k = 0; k < 300 * kSecond; ++k) {
      if (k % 35 == 0) command = {speed(random), speed(random)};
      ASSERT_STREQ(robot.drive(command, 1).reason(), "") << "limit x " << ratio << ", sample " << k;
    }
  }
}

/// At rest its noise shows in few samples; in the middle of a step it repeats for long.
TEST(FaultMonitor, AQuantisedEncoderIsAliveAsLongAsNothingSaysOtherwise) {
  for (const auto& [step, noise] :
       {std::pair(0.0065, 1.0), {0.0131, 1.0}, {0.06, 1.0}, {0.06, 0.4}, {0.06, 0.7}, {0.0606, 1.0}, {0.1, 1.0}}) {
    Robot robot;
    robot.noise = noise;
    const auto rounded = [quantum = step](Observation& y) {
      for (double* wheel : {&y.wheel_left, &y.wheel_right}) *wheel = quantum * std::round(*wheel / quantum);
    };
    robot.drive(kStand, 10 * kSecond, rounded);
    for (const WheelCommand& command :
         {WheelCommand{50 * step, 50 * step}, kStraight, kTurn, WheelCommand{8.0, 7.0}, WheelCommand{0.9, 1.1}}) {
      for (int k = 0; k < 60 * kSecond; ++k) {
        ASSERT_STREQ(robot.drive(command, 1, rounded).reason(), "") << step << ", " << noise << ", " << k;
      }
      EXPECT_TRUE(robot.monitor.report().valid().all()) << step << ", " << noise;
    }
  }
}

TEST(FaultMonitor, FreezingCanBeSwitchedOff) {
  Robot robot(changed(FaultParameters{}, [](FaultParameters& p) { p.frozen_samples = 0; }));
  robot.drive(kStraight, 3 * kSecond);
  EXPECT_FALSE(robot.drive(kStraight, 3 * kSecond, [](Observation& y) { y.wheel_left = 5.01; }).faulty());
}

// ---- time

TEST(FaultMonitor, KeepsTheTimeOfAnyStep) {
  for (const int steps : {8, 12, 14, 7, 1}) {  // of 20 ms: 400, 600, 700, 350 and 50 Hz
    FaultMonitor by_steps({}, {}, model()), by_milliseconds({}, {}, model());
    WheelBelief wheel(model(), kRadius, {});
    for (int k = 1; k <= 150; ++k) {
      const WheelCommand command = k < 100 ? WheelCommand{8.0, 8.0} : WheelCommand{};
      for (int i = 0; i < steps; ++i) by_steps.advance(command, kPeriod / steps);
      for (int i = 0; i < 20; ++i) by_milliseconds.advance(command, 0.001);
      for (int i = 0; i < 20; ++i) wheel.predict(command.left);
      Observation y;
      y.stamp = kPeriod * k;
      y.wheel_left = y.wheel_right = wheel.speed() + 0.03 * std::sin(7.0 * k);
      y.acceleration_x = kRadius * wheel.acceleration() + 0.02 * std::sin(5.0 * k);
      const FaultReport &expected = by_milliseconds.check(y), &found = by_steps.check(y);
      ASSERT_NEAR(found.wheel_left.distance, expected.wheel_left.distance, 0.03) << steps << " steps, sample " << k;
      ASSERT_NEAR(found.gyro.probability, expected.gyro.probability, 1e-3) << steps << " steps, sample " << k;
      ASSERT_NEAR(found.accelerometer.probability, expected.accelerometer.probability, 0.01) << steps << ", " << k;
    }
  }
}

}  // namespace
}  // namespace jackal_aic
