#include "jackal_aic/model/traction_belief.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;
constexpr double kDeviation = 0.05;
constexpr double kVariance = kDeviation * kDeviation;

/// A part of a drive: its time [s], the accelerations of wheels and body [m/s^2].
struct Part {
  double time, wheels, body;
};

/// Wheels and a body, each with an acceleration of its own.
class Robot {
 public:
  explicit Robot(double turning_centre = 0.0, double noise = kDeviation, unsigned seed = 1)
      : belief(turning_centre), random_(seed), noise_(noise) {}

  /// @param offset of the measured acceleration [m/s^2].
  void drive(double time, double wheels, double body, double offset = 0.0) {
    for (int k = 0; k < std::lround(time / kPeriod); ++k) {
      wheel_speed += wheels * kPeriod;
      body_speed += body * kPeriod;
      measured = body + offset + noise_ * normal_(random_);
      belief.correct(wheel_speed, measured, kVariance, yaw_rate, kPeriod);
      slid = slid || belief.traction() != Traction::rolls;
    }
  }

  void drive(const std::vector<Part>& parts, double offset = 0.0) {
    for (const Part& part : parts) drive(part.time, part.wheels, part.body, offset);
  }

  /// Drives on ground that grips: then it is known that the attitude takes no acceleration for tilt.
  void proveItsAttitude(double offset = 0.0) {
    drive({{0.6, 1.65, 1.65}, {1.0, 0.0, 0.0}, {0.6, -1.65, -1.65}, {1.0, 0.0, 0.0}}, offset);
  }

  double error() const { return belief.speed(wheel_speed) - body_speed; }

  TractionBelief belief;
  double wheel_speed = 0.0, body_speed = 0.0, yaw_rate = 0.0;
  double measured = 0.0;  // the last acceleration [m/s^2]
  bool slid = false;

 private:
  std::mt19937 random_;
  double noise_;
  std::normal_distribution<double> normal_;
};

TEST(TractionBelief, GrippingWheelsAreBelieved) {
  for (const double noise : {0.05, 0.3}) {
    Robot robot(0.0, noise);
    for (int cycle = 0; cycle < 20; ++cycle) {
      robot.drive({{1.0, 1.5, 1.5}, {1.0, 0.0, 0.0}, {1.0, -1.5, -1.5}, {1.0, 0.0, 0.0}});
    }
    EXPECT_FALSE(robot.slid) << noise;
    EXPECT_EQ(robot.belief.speed(0.7), 0.7);
    EXPECT_EQ(robot.belief.variance(), 0.0);
  }
}

TEST(TractionBelief, GravityAndOffsetsAreNoSlide) {
  Robot slopes, unknown;
  slopes.drive(0.5, 1.0, 1.0);  // an IMU without attitude
  for (const double degrees : {3.0, 0.0, -3.0, 5.0, 0.0}) {
    slopes.drive(3.0, 0.0, 0.0, 9.81 * std::sin(degrees * M_PI / 180.0));
  }
  EXPECT_FALSE(slopes.slid);
  // First measured while it drives, on a slope or with an accelerometer that is off, and brakes.
  unknown.body_speed = unknown.wheel_speed = 1.0;
  unknown.drive({{0.3, 0.0, 0.0}, {0.8, -0.6, -0.6}}, 0.45);
  EXPECT_FALSE(unknown.slid);
  for (const double gravity : {0.5, 1.0, -1.7}) {
    Robot known;  // after a second at rest
    known.drive(1.0, 0.0, 0.0, gravity);
    for (const double way : {2.0, -2.0}) {
      known.drive({{0.3, way, way}, {2.0, 0.0, 0.0}, {0.3, -way, -way}, {0.7, 0.0, 0.0}}, gravity);
    }
    EXPECT_FALSE(known.slid) << gravity;
  }
}

/// True if a robot that rolls behind an attitude filter is ever believed to slide. A Madgwick filter follows a
/// measured acceleration by a limited rate, a Mahony filter in proportion.
bool slidesBehindFilter(bool madgwick, double gain, double speed, double acceleration, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  TractionBelief belief(0.0);
  const double offset = 0.05 * normal(random);
  double wheels = 0.0, tilt = 0.0;  // m/s, m/s^2
  bool slid = false;
  for (int k = 0; k < 2000; ++k) {
    const int time = k % 500;  // of a drive forward or backward in 10 s
    const double goal = time < 50 || time > 350 ? 0.0 : k % 1000 < 500 ? speed : -speed;
    const double a = std::clamp((goal - wheels) / kPeriod, -acceleration, acceleration);
    wheels += a * kPeriod;
    const double measured = a - tilt + offset + noise * (0.3 + std::abs(wheels)) * normal(random),
                 fastest = 2.0 * 9.81 * gain;
    tilt += kPeriod * (madgwick ? std::clamp((a - tilt) / kPeriod, -fastest, fastest) : gain * (a - tilt));
    belief.correct(wheels, measured, kVariance, 0.0, kPeriod);
    slid = slid || belief.traction() != Traction::rolls;
  }
  return slid;
}

TEST(TractionBelief, AttitudeFilterIsNoSlide) {
  for (const auto& [madgwick, gain] : {std::pair(true, 0.05), {true, 0.1}, {true, 0.2}, {false, 0.2}, {false, 0.4}}) {
    for (const double speed : {0.3, 1.0, 2.0}) {
      for (const double acceleration : {0.5, 1.0, 2.0, 5.0}) {
        for (const double noise : {0.05, 0.2}) {
          for (const unsigned seed : {1, 2}) {
            EXPECT_FALSE(slidesBehindFilter(madgwick, gain, speed, acceleration, noise, seed))
                << (madgwick ? "Madgwick " : "Mahony ") << gain << ", " << speed << ", " << acceleration << ", "
                << noise << ", " << seed;
          }
        }
      }
    }
  }
}

/// True if a robot that rolls is ever believed to slide or stand. It drives a random joystick for a minute.
/// @param mount factor on the acceleration; @param hold time [s] in which the encoders repeat a speed, with noise.
bool slidesByJoystick(double mount, double hold, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  TractionBelief belief(0.0);
  double goal = 0.0, speed = 0.0, held = 0.0, until = 0.0, changes = 0.0;
  bool slid = false;
  for (int k = 0; k < 3000; ++k) {
    const double time = k * kPeriod;
    if (time >= changes) {
      goal = uniform(random) < 0.3 ? 0.0 : 2.0 * uniform(random) - 1.0;
      changes = time + 0.5 + 2.5 * uniform(random);
    }
    const double a = std::clamp((goal - speed) / 0.1, -2.0, 2.0);
    speed += a * kPeriod;
    if (time >= until) {
      held = speed;
      until += hold;
    }
    const double wheels = held + 0.01 * normal(random);
    belief.correct(wheels, mount * a + noise * normal(random), kVariance, 0.0, kPeriod);
    slid = slid || belief.traction() != Traction::rolls;
  }
  return slid;
}

TEST(TractionBelief, ReversedAccelerometerIsNoSlide) {
  for (const unsigned seed : {1, 2, 3, 4, 5, 6}) {
    for (const double mount : {-1.0, -0.7}) {
      for (const double noise : {0.05, 0.5}) {
        EXPECT_FALSE(slidesByJoystick(mount, 0.0, noise, seed)) << mount << ", " << noise << ", " << seed;
      }
    }
  }
}

TEST(TractionBelief, LateEncodersAreNoSlide) {
  for (const unsigned seed : {1, 2, 3, 4, 5, 6}) {
    for (const double hold : {0.05, 0.1}) EXPECT_FALSE(slidesByJoystick(1.0, hold, 0.3, seed)) << hold << ", " << seed;
  }
}

TEST(TractionBelief, FastTurnOfUnknownCentreIsNoSlide) {
  Robot robot;
  robot.drive(0.5, 1.0, 1.0);
  robot.yaw_rate = 2.0;
  robot.drive({{5.0, 0.0, 0.0}, {0.3, 1.0, 1.0}}, 0.1 * 4.0);
  EXPECT_FALSE(robot.slid);
  robot.yaw_rate = 0.0;
  robot.drive({{0.5, -1.0, -1.0}, {5.0, 0.0, 0.0}});
  EXPECT_FALSE(robot.slid) << "the centripetal acceleration is not the accelerometer's offset";
  Robot jumps;
  jumps.drive({{0.6, 0.0, 0.0}, {0.2, 1.5, 1.5}});
  jumps.yaw_rate = 1.6;
  jumps.drive({{1.0, 0.0, 0.0}, {0.06, 0.0, -5.0}, {0.5, 0.0, 0.0}});  // 0.3 m/s, from one side to the other
  EXPECT_FALSE(jumps.slid);
}

TEST(TractionBelief, AccelerometerReplacesSpinningWheelsUntilTheyGrip) {
  Robot robot;
  robot.proveItsAttitude();
  robot.drive(0.6, 1.65, 1.0);
  ASSERT_EQ(robot.belief.traction(), Traction::slides);
  EXPECT_NEAR(robot.error(), 0.0, 0.03);
  EXPECT_GT(robot.belief.variance(), 0.0);
  Robot predicted = robot, missed = robot;
  robot.drive(0.42, 0.0, 0.99 - 0.02);
  robot.body_speed = robot.wheel_speed;
  robot.drive(0.3, 0.0, 0.0);
  EXPECT_EQ(robot.belief.traction(), Traction::rolls);
  EXPECT_EQ(robot.belief.variance(), 0.0);
  // Between measurements the body goes on.
  const double before = predicted.belief.speed(predicted.wheel_speed);
  for (int k = 0; k < 20; ++k) predicted.belief.predict(0.001);
  EXPECT_NEAR(predicted.belief.speed(predicted.wheel_speed) - before, 0.02, 3.0 * 0.02 * kDeviation);
  predicted.drive(kPeriod, 1.65, 1.0);
  EXPECT_NEAR(predicted.error(), 0.0, 0.03) << "not counted twice";
  // One missing acceleration is bridged, a long gap ends the slide.
  missed.belief.miss(kPeriod);
  missed.wheel_speed += 1.65 * kPeriod;
  missed.body_speed += kPeriod;
  missed.drive(kPeriod, 1.65, 1.0);
  EXPECT_EQ(missed.belief.traction(), Traction::slides);
  EXPECT_NEAR(missed.error(), 0.0, 0.03);
  missed.belief.correct(missed.wheel_speed, 0.0, kVariance, 0.0, 0.5);
  EXPECT_EQ(missed.belief.traction(), Traction::rolls);
  EXPECT_EQ(missed.belief.speed(0.7), 0.7);
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

TEST(TractionBelief, AccelerometerThatBecomesWrongIsNotFollowed) {
  for (const double offset : {-5.0, -3.0, -1.5, 1.5, 3.0, 5.0}) {
    for (const double speed : {0.3, 0.5, 1.0}) {
      Robot robot;
      robot.drive({{1.0, speed, speed}, {3.0, 0.0, 0.0}});
      for (int k = 0; k < 500; ++k) {
        const double rate = k % 150 < 50 ? 1.0 : k % 150 < 100 ? -1.0 : 0.0;
        robot.drive(kPeriod, rate * speed, rate * speed, offset);
        // At first as of a body that was thrown back.
        ASSERT_LT(std::abs(robot.error()), k > 50 ? 0.05 : 1.7 * speed + 0.2) << offset << ", " << speed << ", " << k;
      }
    }
  }
}

TEST(TractionBelief, CollisionsStopTheBody) {
  const struct {
    const char* what;
    std::vector<Part> parts;
  } rows[] = {
      {"starts against a wall", {{1.0, 0.0, 0.0}, {0.3, 1.65, 0.0}, {0.7, 0.0, 0.0}}},
      {"drives into it", {{0.5, 1.0, 1.0}, {2.0, 0.0, 0.0}, {0.04, 0.0, -12.5}, {0.4, 0.0, 0.0}}},
      {"in two samples", {{0.6, 0.0, 0.0}, {0.3, 1.5, 1.5}, {0.02, 0.0, -11.0}, {0.02, 0.0, -10.0}, {0.5, 0.2, 0.0}}},
      // The wheels go to 0.15 and the body to -0.2 m/s.
      {"is thrown back with its wheels",
       {{0.6, 1.5, 1.5}, {0.5, 0.0, 0.0}, {0.02, -37.5, -55.0}, {0.04, 1.65, 5.0}, {0.45, 1.65, 0.0}}},
      // As it pitches, the IMU moves faster than the wheels.
      {"bounces",
       {{0.6, 1.5, 1.5}, {0.5, 0.0, 0.0}, {0.04, -15.0, -22.5}, {0.06, 0.0, 6.0}, {0.06, 0.0, -6.0}, {0.5, 1.0, 0.0}}}};
  for (const auto& row : rows) {
    Robot robot;
    robot.drive(row.parts);
    EXPECT_EQ(robot.belief.traction(), Traction::stands) << row.what;
    EXPECT_EQ(robot.belief.speed(robot.wheel_speed), 0.0) << row.what;
  }
}

TEST(TractionBelief, StandingBodyStandsUntilItIsFreeOrItsWheelsStop) {
  Robot robot;
  robot.drive({{1.0, 0.0, 0.0}, {0.4, 1.65, 0.0}, {60.0, 0.0, 0.0}});
  ASSERT_EQ(robot.belief.traction(), Traction::stands);
  Robot free = robot;
  robot.drive(0.3, 1.0, 0.0);
  EXPECT_EQ(robot.belief.traction(), Traction::stands) << "the wheels alone are faster";
  robot.drive(0.96, -1.0, 0.0);
  EXPECT_EQ(robot.belief.traction(), Traction::rolls) << "the wheels stand too";
  free.drive(0.32, 0.0, 2.0);
  EXPECT_NE(free.belief.traction(), Traction::stands);
  EXPECT_NEAR(free.error(), 0.0, 0.05);
  free.body_speed = free.wheel_speed;
  free.drive(0.5, 0.0, 0.0);
  EXPECT_EQ(free.belief.traction(), Traction::rolls);
}

TEST(TractionBelief, CollisionIsDetectedAtTenSamplesASecond) {
  for (const double period : {0.02, 0.05, 0.066, 0.1, 0.12}) {
    TractionBelief belief(0.0);
    double speed = 0.0;
    bool detected = false;
    for (double time = 0.0; time < 6.0; time += period) {
      const double before = std::exchange(speed, time < 4.0 ? std::min(1.0, 0.5 * time) : 0.0);
      // Even a little noise makes of two samples two.
      const double a = (speed - before) / period + (std::fmod(time, 2.0 * period) < period ? 0.01 : -0.01);
      belief.correct(std::min(1.0, 0.5 * time), a, kVariance, 0.0, period);
      detected = detected || belief.traction() != Traction::rolls;
      ASSERT_TRUE(time >= 3.9 || !detected) << period;
    }
    EXPECT_TRUE(detected) << period;
  }
}

/// The more it vibrates, the less shows that the body was freed; where nothing would, it does not stand for long.
TEST(TractionBelief, FreedBodyIsFoundInVibration) {
  for (const double vibration : {0.5, 1.0, 2.0}) {
    for (const double speed : {0.5, 1.0}) {
      Robot robot(0.0, vibration * speed);
      robot.drive({{1.0, 0.0, 0.0},
                   {1.0, speed, speed},
                   {5.0, 0.0, 0.0},
                   {0.06, 0.0, -speed / 0.06},
                   {2.0, 0.0, 0.0},
                   {0.5, 0.0, 2.0 * speed},
                   {2.0, 0.0, 0.0}});
      EXPECT_TRUE(robot.slid || vibration > 1.0) << vibration;
      EXPECT_EQ(robot.belief.traction(), Traction::rolls) << vibration << " m/s^2 at 1 m/s, " << speed << " m/s";
    }
  }
}

/// Whether a robot that grips is taken for one that slides. @param shaking deviation of its coloured vibration at 1 m/s
/// [m/s^2], which grows with the speed; @param parts driven five times.
bool slides(double period, double shaking, const std::vector<Part>& parts, std::mt19937& random) {
  constexpr double kCorrelation = 0.02;  // s
  std::normal_distribution<double> normal;
  const double kept = std::exp(-period / kCorrelation);
  TractionBelief belief(0.0);
  double speed = 0.0, shaken = 0.0;
  bool slid = false;
  for (int cycle = 0; cycle < 5; ++cycle) {
    for (const Part& part : parts) {
      for (double time = 0.0; time < part.time; time += period) {
        speed += part.wheels * period;
        shaken = kept * shaken + std::sqrt(1.0 - kept * kept) * normal(random);
        const double measured = part.body + kDeviation * normal(random) + shaking * speed * shaken;
        belief.correct(speed, measured, kVariance, 0.0, period);
        slid = slid || belief.traction() != Traction::rolls;
      }
    }
  }
  return slid;
}

TEST(TractionBelief, ColouredVibrationIsNoSlideAtAnySensorRate) {
  for (const double rate : {50.0, 100.0, 200.0, 400.0, 1000.0}) {
    std::mt19937 random(1);
    int slid = 0;
    const std::vector<Part> parts{{0.6, 1.65, 1.65}, {1.4, 0.0, 0.0}, {0.6, -1.65, -1.65}, {1.4, 0.0, 0.0}};
    for (int robot = 0; robot < 100; ++robot) slid += slides(1.0 / rate, 1.0, parts, random) ? 1 : 0;
    EXPECT_LE(slid, 2) << rate << " Hz";
  }
}

TEST(TractionBelief, ASlowDriveIsNoQuieterThanRest) {
  for (const double noise : {0.1, 0.3, 0.6}) {
    for (unsigned seed = 0; seed < 20; ++seed) {
      Robot robot(0.0, noise, seed);
      for (int cycle = 0; cycle < 5; ++cycle) {
        robot.drive(
            {{2.0, 0.0, 0.0}, {1.0, 1.5, 1.5}, {5.0, 0.0, 0.0}, {0.9, -1.5, -1.5}, {5.0, 0.0, 0.0}, {0.1, -1.5, -1.5}});
      }
      EXPECT_FALSE(robot.slid) << noise << " m/s^2, seed " << seed;
    }
  }
}

TEST(TractionBelief, AFastDriveShakesMoreThanTheSlowOneBefore) {
  const std::vector<Part> parts{{0.1, 2.0, 2.0}, {5.0, 0.0, 0.0}, {0.6, 2.0, 2.0}, {1.2, -2.0, -2.0}, {0.5, 2.0, 2.0}};
  std::mt19937 random(1);
  int slid = 0;
  for (int robot = 0; robot < 200; ++robot) slid += slides(kPeriod, 2.0, parts, random) ? 1 : 0;
  EXPECT_LE(slid, 2);
}

}  // namespace
}  // namespace jackal_aic
