#include "jackal_aic/predictive/turn.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

namespace jackal_aic {
namespace {

constexpr double kRadius = 0.098;
constexpr double kPeriod = 0.02;
constexpr double kExcitation = 0.5;
const SlipState kConfigured{0.5621, 1.0};
constexpr double kRatio = 1.0 / 0.5621;  // 1/m

/// A motion of the wheels [m/s].
struct Motion {
  double x, v;

  WheelVector wheels() const { return WheelVector(v - 0.5 * x, v + 0.5 * x) / kRadius; }
};

double yawRateOf(const Eigen::Vector4d& q, const Motion& m) {
  return q(0) * m.x + q(1) * m.x * std::abs(m.v) + q(2) * m.v + q(3) * m.v * std::abs(m.x);
}

/// A sample of a gyro.
void take(Turn& turn, double yaw_rate, const WheelVector& wheels, double step = kPeriod, double lateral = 0.0) {
  turn.pass(step);
  turn.learn({yaw_rate, lateral, wheels, wheels, 2.5e-5}, kExcitation, step);
}

void take(Turn& turn, double yaw_rate, const Motion& m, double step = kPeriod) {
  take(turn, yaw_rate, m.wheels(), step);
}

/// Drives random motions for a second each, with a gyro as noisy as a real one; learns from it.
void drive(const Eigen::Vector4d& truth, int motions, Turn& turn) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> speed(-1.0, 1.0), difference(-0.8, 0.8);
  std::normal_distribution<double> noise(0.0, 0.01);
  for (int i = 0; i < motions; ++i) {
    const Motion m{difference(random), speed(random)};
    for (int k = 0; k < 50; ++k) take(turn, yawRateOf(truth, m) + noise(random), m);
  }
  turn.pass(60.0);
}

Eigen::Matrix4d covariance(const Turn& turn) { return turn.state().turn->covariance; }

TEST(Turn, LearnsHowItDependsOnTheMotion) {
  for (const Eigen::Vector4d& truth :
       {Eigen::Vector4d(1.5, 0.1, 0.03, -0.08), Eigen::Vector4d(2.4, -0.12, -0.05, 0.1)}) {
    Turn turn(kConfigured, kRadius);
    drive(truth, 120, turn);
    EXPECT_LT((turn.mean() - truth).cwiseAbs().maxCoeff(), 0.05) << turn.mean().transpose();
    constexpr double h = 1e-6;
    for (const Motion& m : {Motion{0.5, 0.8}, Motion{-0.5, 0.8}, Motion{0.4, -0.8}, Motion{-0.2, -0.3}}) {
      EXPECT_NEAR(turn.yawRate(m.wheels()), yawRateOf(truth, m), 0.02);
      EXPECT_NEAR(kRadius * turn.wheelDifference(yawRateOf(truth, m), m.v / kRadius), m.x, 0.01);
      const WheelVector more = Motion{m.x + h * kRadius, m.v}.wheels(), less = Motion{m.x - h * kRadius, m.v}.wheels();
      EXPECT_NEAR(turn.yawPerDifference(m.wheels()), (turn.yawRate(more) - turn.yawRate(less)) / (2 * h), 1e-6);
    }
  }
  Turn one(kConfigured, kRadius);
  drive({1.4, 0.0, 0.0, 0.0}, 120, one);
  EXPECT_NEAR(one.mean()(0), 1.4, 0.005);
  EXPECT_LT(one.mean().tail<3>().cwiseAbs().maxCoeff(), 0.01 * kRatio) << "stays one track";
}

TEST(Turn, LearnsByTimeAndNotByTheNumberOfSamples) {
  Turn slow(kConfigured, kRadius), fast(kConfigured, kRadius);  // gyros at 50 and at 200 Hz
  for (int k = 0; k < 50; ++k) take(slow, 0.8, Motion{0.5, 0.5}, 0.02);
  for (int k = 0; k < 200; ++k) take(fast, 0.8, Motion{0.5, 0.5}, 0.005);
  EXPECT_LT((slow.mean() - fast.mean()).cwiseAbs().maxCoeff(), 0.05 * std::sqrt(covariance(slow)(0, 0)));
  EXPECT_LT((covariance(slow) - covariance(fast)).cwiseAbs().maxCoeff(), 0.02 * covariance(slow).cwiseAbs().maxCoeff());
}

TEST(Turn, StraightLineShowsTheVeerAlone) {
  Turn turn(kConfigured, kRadius);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.01);
  for (int k = 0; k < 50 * 1800; ++k) {  // half an hour; x is the encoders' noise
    take(turn, 0.02 * 0.8 + noise(random), Motion{0.3 * noise(random), 0.8});
  }
  EXPECT_NEAR(turn.mean()(2), 0.02, 0.002);
  EXPECT_NEAR(turn.mean()(0), kRatio, 1e-3 * kRatio);
  const double known = covariance(turn)(2, 2);
  for (int k = 0; k < 50 * 300; ++k) take(turn, 0.9, Motion{0.5, 0.0});
  EXPECT_GT(covariance(turn)(2, 2), 2.0 * known) << "five minutes of turning forget it";
}

TEST(Turn, ArcTeachesNoVeer) {
  // Arcs to one side, whose turn differs from the configured one: veer would explain a part of it.
  Turn turn(kConfigured, kRadius);
  for (int k = 0; k < 50 * 10; ++k) take(turn, 1.2 * kRatio * 0.5, Motion{0.5, 0.5});
  EXPECT_NEAR(turn.yawPerDifference(Motion{0.5, 0.5}.wheels()), 1.2 * kRadius * kRatio, 0.02 * kRadius * kRatio);
  EXPECT_EQ(turn.yawRate(Motion{0.0, 0.5}.wheels()), 0.0);
}

TEST(Turn, YawRateThatNoGroundMakesTeachesNothing) {
  for (const double yaw_rate : {0.3, -0.3}) {
    Turn turn(kConfigured, kRadius);
    for (int k = 0; k < 15; ++k) take(turn, yaw_rate, Motion{0.0, 0.5});  // 0.3 s, until a wrong gyro is found
    EXPECT_EQ(turn.yawRate(Motion{0.0, 0.5}.wheels()), 0.0) << yaw_rate;
    take(turn, 0.01, Motion{0.0, 0.5});
    EXPECT_GT(turn.yawRate(Motion{0.0, 0.5}.wheels()), 0.0) << "a possible veer is learned";
  }
}

TEST(Turn, NothingDriftsWithoutExcitation) {
  Turn turn(kConfigured, kRadius);
  std::mt19937 random(11);
  std::normal_distribution<double> unit(0.0, 1.0);
  for (const double speed : {0.0, 5.0}) {
    for (int k = 0; k < 50 * 600; ++k)
      take(turn, 0.005 * unit(random), WheelVector(speed + 0.03 * unit(random), speed + 0.03 * unit(random)));
    EXPECT_DOUBLE_EQ(turn.effectiveTrack(), kConfigured.effective_track) << "ten minutes at " << speed;
  }
}

TEST(Turn, ForgetsDownToThePriorAndNotBelow) {
  Turn turn(kConfigured, kRadius);
  const Eigen::Matrix4d prior = covariance(turn);
  drive({1.5, 0.2, 0.03, -0.1}, 60, turn);
  EXPECT_LT(covariance(turn)(1, 1), 0.6 * prior(1, 1));
  const Eigen::Vector4d learned = turn.mean();
  const Motion in_place{0.5, 0.0};  // says nothing about the speed
  turn.pass(600.0);                 // the ground's share has faded
  for (int k = 0; k < 150000; ++k) take(turn, yawRateOf(learned, in_place), in_place);
  const Eigen::Matrix4d left = covariance(turn), forgotten = left - prior;
  EXPECT_LT(forgotten.bottomRightCorner(3, 3).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT(left(0, 0), 0.01 * prior(0, 0));
  EXPECT_LT((turn.mean() - learned).cwiseAbs().maxCoeff(), 1e-9) << "what was learned stays";
}

TEST(Turn, StaysInvertibleUnderRandomSamples) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-5.0, 5.0);
  Turn turn(kConfigured, kRadius);
  for (int k = 0; k < 5000; ++k) take(turn, any(random), Motion{any(random), any(random)});
  ASSERT_TRUE(turn.mean().allFinite());
  for (int k = 0; k < 1000; ++k) {
    const Motion m{any(random), any(random)};
    EXPECT_GE(turn.yawPerDifference(m.wheels()), kRadius * kRatio / 1.5 - 1e-12);
    EXPECT_LE(turn.yawPerDifference(m.wheels()), kRadius * kRatio * 1.5 + 1e-12);
    EXPECT_NEAR(kRadius * turn.wheelDifference(turn.yawRate(m.wheels()), m.v / kRadius), m.x, 1e-9);
  }
}

/// The ground of one turn does not last: the next turn is that of the robot.
TEST(Turn, GroundOfATurnFades) {
  Turn turn(kConfigured, kRadius);
  drive({1.5, 0.0, 0.0, 0.0}, 120, turn);
  const WheelVector wheels = Motion{0.5, 0.0}.wheels();
  for (int k = 0; k < 25; ++k) take(turn, 1.3 * 0.5, wheels);  // half a second on slippery ground
  EXPECT_NEAR(turn.yawRate(wheels), 1.3 * 0.5, 0.02);
  EXPECT_NEAR(turn.usualYawRate(wheels), 1.5 * 0.5, 0.02);
  for (int k = 0; k < 150; ++k) turn.pass(kPeriod);
  EXPECT_NEAR(turn.yawRate(wheels), 1.5 * 0.5, 0.03);
  EXPECT_NEAR(kRadius * turn.wheelDifference(0.75, 0.0), 0.5, 0.02);
}

/// A robot of a given track whose sensors are as noisy as the simulated one's.
class TurningRobot {
 public:
  TurningRobot(double track, Turn& turn) : track_(track), turn_(turn) {}

  /// Drives with a speed of the wheels' circumference [m/s] and a yaw rate [rad/s] for a time [s].
  void drive(double speed, double yaw_rate, double seconds) {
    const WheelVector wheels = Motion{track_ * yaw_rate, speed}.wheels();
    for (int k = 0; k < std::lround(seconds / kPeriod); ++k) {
      const WheelVector noise(0.01 * unit_(random_), 0.01 * unit_(random_));
      take(turn_, yaw_rate + 0.005 * unit_(random_), wheels + noise);
    }
  }

 private:
  double track_;
  Turn& turn_;
  std::mt19937 random_{11};
  std::normal_distribution<double> unit_{0.0, 1.0};
};

TEST(Turn, LearnsTheTrack) {
  for (const double track : {0.45, 0.5621, 0.7}) {
    Turn turn(kConfigured, kRadius);
    TurningRobot robot(track, turn);
    for (const auto& [speed, yaw_rate] : {std::pair(0.0, 0.0), std::pair(1.0, 0.0), std::pair(0.0, 0.5)}) {
      robot.drive(speed, yaw_rate, 2.0);
    }
    EXPECT_NEAR(turn.effectiveTrack(), track, 0.03 * track);
  }
  // A Husky on its floor turns by half of what is assumed of it, and less on a smoother one. Its file allows a track of
  // a quarter to four times the configured one.
  Turn turn(kConfigured, kRadius, 4.0);
  TurningRobot husky(3.0 * 0.5621, turn);
  for (int i = 0; i < 10; ++i) husky.drive(0.5, i % 2 == 0 ? 0.4 : -0.4, 2.0);
  EXPECT_NEAR(turn.state().effective_track, 3.0 * 0.5621, 0.05 * 3.0 * 0.5621);
}

/// In an arc the lateral acceleration v theta_dot tells slippery ground from a gyro that reads half.
TEST(Turn, LearnsNothingThatTheLateralAccelerationContradicts) {
  constexpr double v = 1.0, gyro = 0.75;  // m/s; of the yaw rate of the wheels
  const struct {
    const char* name;
    double lateral;  // of v times the yaw rate of the wheels
    bool learns;
  } rows[] = {{"slippery ground", gyro, true},
              {"no accelerometer", 0.0, true},
              {"banked ground, inclined inwards", gyro - 0.5, true},
              {"a body that turns twice as fast as the gyro reads", 2.0 * gyro, false}};
  const WheelVector wheels = Motion{5.0 * kRadius, v}.wheels();
  const double asked = 5.0 * kRadius * kRatio;
  for (const auto& row : rows) {
    Turn turn(kConfigured, kRadius);
    std::mt19937 random(3);
    std::normal_distribution<double> noise(0.0, 0.3);  // m/s^2
    for (int k = 0; k < 500; ++k) {
      const double lateral = row.lateral == 0.0 ? 0.0 : v * row.lateral * asked + noise(random);
      take(turn, gyro * asked, wheels, kPeriod, lateral);
    }
    EXPECT_NEAR(turn.yawPerDifference(wheels), kRadius * (row.learns ? gyro : 1.0) * kRatio, 0.03 * kRadius * kRatio)
        << row.name;
  }
}

TEST(Turn, WithdrawsTheLastTurnsOfAFaultySensor) {
  Turn turn(kConfigured, kRadius);
  TurningRobot robot(0.65, turn);
  for (int i = 0; i < 10; ++i) robot.drive(0.5, i % 2 == 0 ? 0.6 : -0.6, 2.0);
  EXPECT_NEAR(turn.effectiveTrack(), 0.65, 0.03);
  const Motion in_place{5.0 * kRadius, 0.0};
  for (int k = 0; k < 50; ++k) take(turn, 0.7 * in_place.x / 0.65, in_place);
  EXPECT_GT(turn.effectiveTrack(), 0.75);
  turn.withdraw();
  EXPECT_NEAR(turn.effectiveTrack(), 0.65, 0.03);
}

TEST(Turn, KeepsInItsStateHowItDependsOnTheSpeed) {
  // Two grounds in one: turning in place and turning at speed, each for longer than the fast part remembers.
  Turn turn(kConfigured, kRadius), kept(turn);
  TurningRobot slow(0.6, turn), fast(0.5, turn);
  const Motion in_place{0.6 * 0.6, 0.0}, arc{0.5 * 0.6, 1.0};
  slow.drive(1.0, 0.0, 10.0);  // shows that no veer makes the difference
  for (int i = 0; i < 10; ++i) {
    slow.drive(0.0, 0.6, 2.0);
    EXPECT_NEAR(turn.yawRate(in_place.wheels()), 0.6, 0.02);
    fast.drive(1.0, 0.6, 2.0);
    EXPECT_NEAR(turn.yawRate(arc.wheels()), 0.6, 0.02);
  }
  const WheelVector wheels = turn.wheelSpeeds(0.0, 0.6);
  EXPECT_NEAR(wheels(1) - wheels(0), in_place.x / kRadius, 0.05 * in_place.x / kRadius)
      << "turning in place is known again although the robot came from a fast turn";
  kept.setState(turn.state());
  slow.drive(0.0, 0.0, 10.0);  // until what the ground did last has faded
  EXPECT_NEAR(kept.effectiveTrack(), turn.effectiveTrack(), 1e-3);
  for (const double mean : {0.0, 5.0, 10.0}) {
    EXPECT_NEAR(kept.yawRate({mean - 2.0, mean + 2.0}), turn.yawRate({mean - 2.0, mean + 2.0}), 1e-3);
  }
  kept.setState({0.55, 1.0});
  EXPECT_DOUBLE_EQ(kept.yawRate({8.0, 12.0}), kRadius * 4.0 / 0.55) << "a state without it is one track";
}

}  // namespace
}  // namespace jackal_aic
