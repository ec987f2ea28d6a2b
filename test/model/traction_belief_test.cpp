#include "jackal_aic/model/traction_belief.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;
constexpr double kDeviation = 0.05;
constexpr double kVariance = kDeviation * kDeviation;

/// Wheels and a body on its way, each with an acceleration of its own.
class Robot {
 public:
  explicit Robot(double turning_centre = 0.0, double noise = kDeviation) : belief(turning_centre), noise_(noise) {
    belief.reset(0.0);
  }

  /// Goes on for a time [s] with the accelerations of wheels and body [m/s^2].
  void drive(double time, double wheels, double body, double measured_offset = 0.0) {
    for (int k = 0; k < std::lround(time / kPeriod); ++k) {
      wheel_speed += wheels * kPeriod;
      body_speed += body * kPeriod;
      measured = body + measured_offset + noise_(random_);
      belief.correct(wheel_speed, measured, kVariance, yaw_rate, kPeriod);
      slid = slid || belief.traction() != Traction::rolls;
    }
  }

  /// Drives on ground that grips: then it is known that the attitude takes no acceleration for tilt.
  void proveItsAttitude(double measured_offset = 0.0) {
    for (const double way : {1.0, -1.0}) {
      drive(0.6, way * 1.65, way * 1.65, measured_offset);
      drive(1.0, 0.0, 0.0, measured_offset);
    }
  }

  double error() const { return belief.speed(wheel_speed) - body_speed; }

  TractionBelief belief;
  double wheel_speed = 0.0, body_speed = 0.0, yaw_rate = 0.0;
  double measured = 0.0;  // the last acceleration [m/s^2]
  bool slid = false;

 private:
  std::mt19937 random_{1};
  struct Noise {
    explicit Noise(double deviation) : deviation(deviation) {}
    double operator()(std::mt19937& random) { return deviation * normal(random); }
    double deviation;
    std::normal_distribution<double> normal;
  } noise_;
};

TEST(TractionBelief, WheelsThatGripAreBelieved) {
  for (const double noise : {0.05, 0.3}) {
    Robot robot(0.0, noise);
    for (int cycle = 0; cycle < 20; ++cycle) {
      robot.drive(1.0, 1.5, 1.5);
      robot.drive(1.0, 0.0, 0.0);
      robot.drive(1.0, -1.5, -1.5);
      robot.drive(1.0, 0.0, 0.0);
    }
    EXPECT_FALSE(robot.slid) << noise;
    EXPECT_EQ(robot.belief.speed(0.7), 0.7);
    EXPECT_EQ(robot.belief.variance(), 0.0);
  }
}

TEST(TractionBelief, WheelsThatSpinUpAreLeftToTheAccelerometerUntilTheBodyHasMetThem) {
  Robot robot;
  robot.proveItsAttitude();
  robot.drive(0.6, 1.65, 1.0);
  EXPECT_EQ(robot.belief.traction(), Traction::slides);
  EXPECT_NEAR(robot.error(), 0.0, 0.03);
  EXPECT_GT(robot.belief.variance(), 0.0);
  robot.drive(0.42, 0.0, 0.99 - 0.02);
  robot.body_speed = robot.wheel_speed;
  robot.drive(0.3, 0.0, 0.0);
  EXPECT_EQ(robot.belief.traction(), Traction::rolls);
  EXPECT_EQ(robot.belief.variance(), 0.0);
}

TEST(TractionBelief, BodyThatSlidesGoesOnBetweenMeasurements) {
  Robot robot;
  robot.proveItsAttitude();
  robot.drive(0.6, 1.65, 1.0);
  ASSERT_EQ(robot.belief.traction(), Traction::slides);
  const double before = robot.belief.speed(robot.wheel_speed);
  for (int k = 0; k < 20; ++k) robot.belief.predict(0.001);
  EXPECT_NEAR(robot.belief.speed(robot.wheel_speed) - before, 0.02, 3.0 * 0.02 * kDeviation);
  robot.drive(kPeriod, 1.65, 1.0);
  EXPECT_NEAR(robot.error(), 0.0, 0.03) << "not counted twice";
}

TEST(TractionBelief, LockedWheelsSlide) {
  Robot robot;
  robot.drive(1.0, 1.0, 1.0);
  robot.drive(1.0, 0.0, 0.0);
  robot.drive(0.5, -2.0, -1.0);
  EXPECT_EQ(robot.belief.traction(), Traction::slides);
  EXPECT_NEAR(robot.error(), 0.0, 0.03);
}

TEST(TractionBelief, BodyThatStandsAgainstSomethingIsToldWithinASecondAndForAsLong) {
  Robot robot;
  robot.drive(1.0, 0.0, 0.0);
  robot.drive(0.3, 1.65, 0.0);
  robot.drive(0.7, 0.0, 0.0);
  EXPECT_EQ(robot.belief.traction(), Traction::stands);
  EXPECT_NEAR(robot.error(), 0.0, 1e-9);
  robot.drive(60.0, 0.0, 0.0);
  EXPECT_EQ(robot.belief.traction(), Traction::stands);
  robot.drive(0.3, 1.0, 0.0);
  EXPECT_EQ(robot.belief.traction(), Traction::stands) << "wheels alone are faster";
  robot.drive(0.8, -1.0, 0.0);
  EXPECT_EQ(robot.belief.traction(), Traction::rolls) << "wheels stand too";
}

TEST(TractionBelief, BodyThatIsFreeAgainGoesOn) {
  Robot robot;
  robot.drive(1.0, 0.0, 0.0);
  robot.drive(0.4, 1.65, 0.0);
  robot.drive(2.0, 0.0, 0.0);
  ASSERT_EQ(robot.belief.traction(), Traction::stands);
  robot.drive(0.32, 0.0, 2.0);
  EXPECT_NE(robot.belief.traction(), Traction::stands);
  EXPECT_NEAR(robot.error(), 0.0, 0.05);
  robot.body_speed = robot.wheel_speed;
  robot.drive(0.5, 0.0, 0.0);
  EXPECT_EQ(robot.belief.traction(), Traction::rolls);
}

/// The more it vibrates, the less shows that it was let go; where nothing would, it is not said to stand for long.
TEST(TractionBelief, BodyThatIsLetGoInVibrationIsNotLeftBehind) {
  for (const double vibration : {0.5, 1.0, 2.0}) {
    for (const double speed : {0.5, 1.0}) {
      Robot robot(0.0, vibration * speed);
      robot.drive(1.0, 0.0, 0.0);
      robot.drive(1.0, speed, speed);
      robot.drive(5.0, 0.0, 0.0);
      robot.drive(0.06, 0.0, -speed / 0.06);
      robot.drive(2.0, 0.0, 0.0);
      robot.drive(0.5, 0.0, 2.0 * speed);
      robot.drive(2.0, 0.0, 0.0);
      EXPECT_TRUE(robot.slid || vibration > 1.0) << vibration;
      EXPECT_EQ(robot.belief.traction(), Traction::rolls) << vibration << " m/s^2 at 1 m/s, " << speed << " m/s";
    }
  }
}

TEST(TractionBelief, CollisionIsToldByAnAccelerometerOfTenSamplesASecond) {
  for (const double period : {0.02, 0.05, 0.066, 0.1, 0.12}) {
    TractionBelief belief(0.0);
    belief.reset(0.0);
    double speed = 0.0;
    bool told = false;
    for (double time = 0.0; time < 6.0; time += period) {
      const double before = std::exchange(speed, time < 4.0 ? std::min(1.0, 0.5 * time) : 0.0);
      // Even a little noise makes of two samples two.
      const double a = (speed - before) / period + (std::fmod(time, 2.0 * period) < period ? 0.01 : -0.01);
      belief.correct(std::min(1.0, 0.5 * time), a, kVariance, 0.0, period);
      told = told || belief.traction() != Traction::rolls;
      ASSERT_TRUE(time >= 3.9 || !told) << period;
    }
    EXPECT_TRUE(told) << period;
  }
}

TEST(TractionBelief, CollisionStopsTheBodyThoughTheWheelsTurnOn) {
  Robot robot;
  robot.drive(0.5, 1.0, 1.0);
  robot.drive(2.0, 0.0, 0.0);
  robot.drive(0.04, 0.0, -12.5);
  robot.drive(0.4, 0.0, 0.0);
  EXPECT_EQ(robot.belief.traction(), Traction::stands);
  EXPECT_NEAR(robot.error(), 0.0, 1e-9);
}

TEST(TractionBelief, BodyThatIsThrownBackWhileItsWheelsAreStoppedTooStands) {
  Robot robot;
  robot.drive(0.6, 1.5, 1.5);
  robot.drive(0.5, 0.0, 0.0);
  robot.drive(0.02, -37.5, -55.0);  // to 0.15 and -0.2 m/s
  robot.drive(0.04, 1.65, 5.0);
  robot.drive(0.45, 1.65, 0.0);
  EXPECT_EQ(robot.belief.traction(), Traction::stands);
  EXPECT_EQ(robot.belief.speed(robot.wheel_speed), 0.0);
}

TEST(TractionBelief, BodyThatBouncesHasNotMetItsWheels) {
  Robot robot;
  robot.drive(0.6, 1.5, 1.5);
  robot.drive(0.5, 0.0, 0.0);
  robot.drive(0.04, -15.0, -22.5);  // to 0.3 and 0.0 m/s
  robot.drive(0.06, 0.0, 6.0);      // as it pitches, the IMU moves faster than the wheels
  robot.drive(0.06, 0.0, -6.0);
  robot.drive(0.5, 1.0, 0.0);
  EXPECT_EQ(robot.belief.traction(), Traction::stands);
}

TEST(TractionBelief, WheelsThatTurnBackAreMetThoughItLookedLikeACollision) {
  for (const double offset : {-0.4, -0.8}) {
    Robot robot;
    robot.drive(1.0, 0.7, 0.7);
    robot.drive(3.0, 0.0, 0.0);
    robot.drive(0.08, -16.0, -6.0, offset);
    robot.drive(0.08, 0.0, -6.0, offset);
    ASSERT_EQ(robot.belief.traction(), Traction::slides) << offset;
    // Friction ends where the body has the speed of its wheels, within the time in which a body may bounce.
    robot.drive(0.02, 0.0, (robot.wheel_speed - robot.body_speed) / 0.02, offset);
    robot.drive(0.4, 0.0, 0.0, offset);
    EXPECT_EQ(robot.belief.traction(), Traction::rolls) << offset;
  }
}

TEST(TractionBelief, ACentreOfTurningThatJumpsIsNoCollision) {
  Robot robot;
  robot.drive(0.6, 0.0, 0.0);
  robot.drive(0.2, 1.5, 1.5);
  robot.yaw_rate = 1.6;
  robot.drive(1.0, 0.0, 0.0);
  robot.drive(0.06, 0.0, -5.0);  // 0.3 m/s, as from one side of the robot to the other
  robot.drive(0.5, 0.0, 0.0);
  EXPECT_FALSE(robot.slid);
}

TEST(TractionBelief, ARobotThatTurnsDoesNotStandForGood) {
  Robot robot;
  robot.drive(0.6, 0.0, 0.0);
  robot.drive(0.2, 1.5, 1.5);
  robot.drive(0.04, 0.0, -7.5);
  robot.drive(0.5, 0.0, 0.0);
  ASSERT_EQ(robot.belief.traction(), Traction::stands);
  robot.yaw_rate = 0.4;
  robot.drive(0.3, 0.0, 0.0);
  EXPECT_EQ(robot.belief.traction(), Traction::rolls);
}

TEST(TractionBelief, WhatTurnsIsHeldByNothing) {
  const auto tractionAt = [](double yaw_rate) {
    Robot robot;
    robot.drive(1.0, 0.0, 0.0);
    robot.yaw_rate = yaw_rate;
    robot.drive(0.3, 1.65, 0.0);
    robot.drive(0.7, 0.0, 0.0);
    return robot.belief.traction();
  };
  EXPECT_EQ(tractionAt(0.2), Traction::stands);
  EXPECT_NE(tractionAt(0.4), Traction::stands);
  EXPECT_NE(tractionAt(-0.8), Traction::stands);
}

TEST(TractionBelief, ACollisionIsOneAlsoIfItIsNoticedBeforeItIsOver) {
  Robot robot;
  robot.drive(0.6, 0.0, 0.0);
  robot.drive(0.3, 1.5, 1.5);
  robot.drive(0.02, 0.0, -11.0);
  robot.drive(0.02, 0.0, -10.0);
  robot.drive(0.5, 0.2, 0.0);
  EXPECT_EQ(robot.belief.traction(), Traction::stands);
}

/// An IMU whose messages come in bursts: between two of them the last mean repeats, and the next is that of all the
/// time.
TEST(TractionBelief, WheelsThatAreRenewedFourTimesASecondAreLateAndDoNotSpin) {
  constexpr double kHold = 0.24;  // s
  const auto stood = [](double hold, double phase) {
    Robot robot;
    robot.belief.setWheelsHold(hold);
    double time = phase, held = 0.0;
    bool stands = false;
    const auto drive = [&](double duration, double acceleration) {
      for (int k = 0; k < std::lround(duration / kPeriod); ++k, time += kPeriod) {
        robot.body_speed += acceleration * kPeriod;
        if (std::fmod(time, kHold) < kPeriod) held = robot.body_speed;
        robot.belief.correct(held, acceleration + 0.3 * std::sin(50.0 * time), kVariance, 0.0, kPeriod);
        stands = stands || robot.belief.traction() == Traction::stands;
      }
    };
    drive(1.0, 0.5);
    drive(1.0, 0.0);
    drive(0.12, -8.0);
    drive(1.0, 0.0);
    return stands;
  };
  int untold = 0;
  for (double phase = 0.0; phase < kHold; phase += kPeriod) {
    untold += stood(0.0, phase) ? 1 : 0;
    EXPECT_FALSE(stood(kHold, phase)) << phase;
  }
  EXPECT_GT(untold, 0);
}

TEST(TractionBelief, AMeanThatRepeatsUntilTheNextComesCostsNoCertainty) {
  Robot robot;
  robot.drive(0.4, 1.5, 1.5);
  for (int k = 0; k < 20; ++k) {
    robot.drive(0.04, 0.0, 0.0);
    robot.belief.correct(robot.wheel_speed, robot.measured, kVariance, 0.0, kPeriod);
  }
  robot.drive(kPeriod, 0.0, 0.0);
  robot.drive(kPeriod, 0.0, -robot.body_speed / kPeriod);
  robot.drive(0.4, 0.0, 0.0);
  EXPECT_EQ(robot.belief.traction(), Traction::stands);
}

/// Coloured vibration of 2.7 m/s^2 at 1 m/s, from rest, before anybody knows how the robot shakes: what looks like a
/// collision by chance takes its time.
TEST(TractionBelief, VibrationSeldomLooksLikeAWall) {
  constexpr int kRobots = 20000;
  constexpr double kVibration = 2.7, kSpeed = 0.5, kKept = 0.37;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  int stands = 0;
  for (int i = 0; i < kRobots; ++i) {
    TractionBelief belief(0.0);
    belief.reset(0.0);
    double speed = 0.0, shaking = 0.0;
    bool stood = false;
    for (int k = 0; k < 150; ++k) {
      const double rate = k > 50 && speed < kSpeed ? 1.65 : 0.0;
      speed = std::min(kSpeed, speed + rate * kPeriod);
      shaking = kKept * shaking + std::sqrt(1.0 - kKept * kKept) * normal(random);
      belief.correct(speed, rate + kDeviation * normal(random) + kVibration * speed * shaking, kVariance, 0.0, kPeriod);
      stood = stood || belief.traction() == Traction::stands;
    }
    stands += stood ? 1 : 0;
  }
  EXPECT_LE(stands, kRobots / 1000);
}

TEST(TractionBelief, SlopeThatAnImuWithoutAttitudeFeelsIsNoSlide) {
  Robot robot;
  robot.drive(0.5, 1.0, 1.0);
  for (const double degrees : {3.0, 0.0, -3.0, 5.0, 0.0}) {
    robot.drive(3.0, 0.0, 0.0, 9.81 * std::sin(degrees * M_PI / 180.0));
  }
  EXPECT_FALSE(robot.slid);
}

TEST(TractionBelief, SlopeThatARobotHasStoodOnForASecondIsKnownWhenItDrives) {
  for (const double gravity : {0.5, 1.0, -1.7}) {
    Robot robot;
    robot.drive(1.0, 0.0, 0.0, gravity);
    for (const double way : {1.0, -1.0}) {
      robot.drive(0.3, way * 2.0, way * 2.0, gravity);
      robot.drive(2.0, 0.0, 0.0, gravity);
      robot.drive(0.3, -way * 2.0, -way * 2.0, gravity);
      robot.drive(0.7, 0.0, 0.0, gravity);
    }
    EXPECT_FALSE(robot.slid) << gravity;
  }
}

/// It is first measured while it drives, on a slope or with an accelerometer that is off, and brakes.
TEST(TractionBelief, BeforeAnythingIsKnownOfTheAccelerometerALittleIsNoSlide) {
  Robot robot;
  robot.body_speed = robot.wheel_speed = 1.0;
  robot.belief.reset(1.0);
  robot.drive(0.3, 0.0, 0.0, 0.45);
  robot.drive(0.8, -0.6, -0.6, 0.45);
  EXPECT_FALSE(robot.slid);
}

TEST(TractionBelief, OffsetOfTheAccelerometerIsLearnedWhileTheSpeedIsKept) {
  Robot robot;
  robot.drive(20.0, 0.0, 0.0, 0.3);
  robot.proveItsAttitude(0.3);
  robot.drive(0.6, 1.65, 1.0, 0.3);
  EXPECT_EQ(robot.belief.traction(), Traction::slides);
  EXPECT_NEAR(robot.error(), 0.0, 0.03);
}

TEST(TractionBelief, AnAccelerometerThatComesToReadWrongIsNotFollowed) {
  for (const double offset : {-5.0, -3.0, -1.5, 1.5, 3.0, 5.0}) {
    for (const double speed : {0.3, 0.5, 1.0}) {
      Robot robot;
      robot.drive(1.0, speed, speed);
      robot.drive(3.0, 0.0, 0.0);
      double largest = 0.0, late = 0.0;
      for (int k = 0; k < 500; ++k) {
        const double rate = k % 150 < 50 ? 1.0 : k % 150 < 100 ? -1.0 : 0.0;
        robot.drive(kPeriod, rate * speed, rate * speed, offset);
        largest = std::max(largest, std::abs(robot.error()));
        if (k > 50) late = std::max(late, std::abs(robot.error()));
      }
      EXPECT_LT(largest, 1.7 * speed + 0.2) << offset << ": as of a body that was thrown back, at " << speed << " m/s";
      EXPECT_LT(late, 0.05) << offset << ": after a second, at " << speed << " m/s";
    }
  }
}

TEST(TractionBelief, CentripetalAccelerationIsNoChangeOfSpeed) {
  constexpr double kCentre = 0.3, kYawRate = 0.7;  // IMU behind the centre of turning: it is pulled forward
  Robot knows(kCentre), does_not;
  for (Robot* robot : {&knows, &does_not}) {
    robot->proveItsAttitude();
    robot->yaw_rate = kYawRate;
    robot->drive(0.8, 1.65, 0.9, kCentre * kYawRate * kYawRate);
    EXPECT_EQ(robot->belief.traction(), Traction::slides);
  }
  EXPECT_NEAR(knows.error(), 0.0, 0.03);
  EXPECT_GT(does_not.error(), 0.09);
}

TEST(TractionBelief, FastTurnOfUnknownCentreIsNoSlide) {
  Robot robot;
  robot.drive(0.5, 1.0, 1.0);
  robot.yaw_rate = 2.0;
  robot.drive(5.0, 0.0, 0.0, 0.1 * 4.0);
  robot.drive(0.3, 1.0, 1.0, 0.1 * 4.0);
  EXPECT_FALSE(robot.slid);
  robot.yaw_rate = 0.0;
  robot.drive(0.5, -1.0, -1.0);
  robot.drive(5.0, 0.0, 0.0);
  EXPECT_FALSE(robot.slid) << "what the accelerometer showed of the turn is not its offset";
}

TEST(TractionBelief, VibrationIsNoSlide) {
  Robot robot(0.0, 2.0);
  robot.drive(5.0, 0.0, 0.0);
  robot.slid = false;
  for (int cycle = 0; cycle < 100; ++cycle) {
    robot.drive(0.6, 1.65, 1.65);
    robot.drive(2.0, 0.0, 0.0);
    robot.drive(0.6, -1.65, -1.65);
    robot.drive(2.0, 0.0, 0.0);
  }
  EXPECT_FALSE(robot.slid);
}

/// Vibration of 1 m/s^2 at 1 m/s that lasts for 20 ms, as sensors of each rate see it.
TEST(TractionBelief, VibrationIsNoSlideHoweverOftenItIsMeasured) {
  constexpr int kRobots = 100;
  constexpr double kCorrelation = 0.02, kEnd = 20.0;  // s
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (const double rate : {50.0, 100.0, 200.0, 400.0, 1000.0}) {
    const double period = 1.0 / rate, kept = std::exp(-period / kCorrelation);
    int slid = 0;
    for (int i = 0; i < kRobots; ++i) {
      TractionBelief belief(0.0);
      belief.reset(0.0);
      double speed = 0.0, shaking = 0.0;
      bool slides = false;
      for (double time = 0.0; time < kEnd; time += period) {
        const double phase = std::fmod(time, 4.0);  // starts, drives, stops and waits
        const double wheels = phase < 0.6 ? 1.65 : phase >= 2.0 && phase < 2.6 ? -1.65 : 0.0;
        speed += wheels * period;
        shaking = kept * shaking + std::sqrt(1.0 - kept * kept) * normal(random);
        belief.correct(speed, wheels + kDeviation * normal(random) + speed * shaking, kVariance, 0.0, period);
        slides = slides || belief.traction() != Traction::rolls;
      }
      slid += slides ? 1 : 0;
    }
    EXPECT_LE(slid, kRobots / 50) << rate << " Hz";
  }
}

TEST(TractionBelief, RobotThatDrivesWhenItIsFirstMeasuredIsNoSlide) {
  Robot robot;
  robot.wheel_speed = robot.body_speed = 1.5;
  robot.drive(0.02, 0.0, 0.0);
  robot.belief.restart();
  robot.wheel_speed = robot.body_speed = -1.5;
  robot.drive(2.0, 0.0, 0.0);
  EXPECT_FALSE(robot.slid);
}

TEST(TractionBelief, AccelerometerThatRepeatsItselfSaysNothing) {
  Robot robot(0.0, 0.0);
  robot.drive(1.0, 0.0, 0.0);
  robot.drive(0.6, 1.65, 0.0);
  robot.drive(2.0, 0.0, 0.0);
  EXPECT_FALSE(robot.slid);
}

TEST(TractionBelief, OneAccelerationThatIsMissingIsBridgedALongGapEndsTheSlide) {
  Robot robot;
  robot.proveItsAttitude();
  robot.drive(0.5, 1.65, 1.0);
  ASSERT_EQ(robot.belief.traction(), Traction::slides);
  robot.belief.miss(robot.wheel_speed, kPeriod);
  robot.wheel_speed += 1.65 * kPeriod;
  robot.body_speed += kPeriod;
  robot.drive(kPeriod, 1.65, 1.0);
  EXPECT_EQ(robot.belief.traction(), Traction::slides);
  EXPECT_NEAR(robot.error(), 0.0, 0.03);
  robot.belief.correct(robot.wheel_speed, 0.0, kVariance, 0.0, 0.5);
  EXPECT_EQ(robot.belief.traction(), Traction::rolls);
  EXPECT_EQ(robot.belief.speed(0.7), 0.7);
}

}  // namespace
}  // namespace jackal_aic
