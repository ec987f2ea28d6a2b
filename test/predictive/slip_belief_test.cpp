#include "jackal_aic/predictive/slip_belief.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

namespace jackal_aic {
namespace {

constexpr double kRadius = 0.098;
constexpr double kPeriod = 0.02;
const SlipState kConfigured{0.5621, 1.0};

/// A robot of a given slip whose sensors are as noisy as the simulated one's.
class SlippingRobot {
 public:
  SlippingRobot(const SlipState& truth, SlipBelief& belief) : truth_(truth), belief_(belief) {}

  /// Drives to a forward speed [m/s] of the wheels' circumference with 1.5 m/s^2, for a time [s].
  void drive(double speed, double yaw_rate, double seconds) {
    for (int k = 0; k < std::lround(seconds / kPeriod); ++k) {
      const double rate = std::clamp((speed - speed_) / kPeriod, -1.5, 1.5);
      const double half_difference = 0.5 * truth_.effective_track * yaw_rate / (truth_.slip_factor * kRadius);
      speed_ += rate * kPeriod;
      const double left = speed_ / kRadius - half_difference + 0.03 * unit_(random_);
      const double right = speed_ / kRadius + half_difference + 0.03 * unit_(random_);
      const double believed = 2.0 * half_difference, mean = speed_ / kRadius;
      belief_.learnTrack(yaw_rate + 0.005 * unit_(random_), 0.0,
                         {believed, 2e-4, 0.0, right - left - believed, mean, 0.5 * (left + right) - mean}, kPeriod);
    }
  }

 private:
  SlipState truth_;
  SlipBelief& belief_;
  double speed_ = 0.0;
  std::mt19937 random_{11};
  std::normal_distribution<double> unit_{0.0, 1.0};
};

TEST(SlipBelief, LearnsTheTrackFromTurns) {
  for (const double track : {0.45, 0.5621, 0.7}) {
    SlipBelief belief(kConfigured, kRadius, {});
    SlippingRobot robot({track, 1.0}, belief);
    for (const auto& [speed, yaw_rate] : {std::pair(0.0, 0.0), std::pair(1.0, 0.0), std::pair(0.0, 0.5)}) {
      robot.drive(speed, yaw_rate, 2.0);
    }
    EXPECT_NEAR(belief.effectiveTrack(), track, 0.03 * track);
  }
  // A Husky on its floor turns by half of what is assumed of it, and less on a smoother one. Its file allows a track of
  // a quarter to four times the configured one.
  SlipLearning wide;
  wide.range = 4.0;
  SlipBelief belief(kConfigured, kRadius, wide);
  SlippingRobot husky({3.0 * 0.5621, 1.0}, belief);
  for (int i = 0; i < 10; ++i) husky.drive(0.5, i % 2 == 0 ? 0.4 : -0.4, 2.0);
  EXPECT_NEAR(belief.state().effective_track, 3.0 * 0.5621, 0.05 * 3.0 * 0.5621);
}

TEST(SlipBelief, NothingDriftsWithoutExcitation) {
  SlipBelief belief(kConfigured, kRadius, {});
  SlippingRobot robot({0.7, 0.8}, belief);
  robot.drive(0.0, 0.0, 60.0);
  EXPECT_EQ(belief.state().effective_track, 0.5621);
  robot.drive(0.5, 0.0, 600.0);
  EXPECT_DOUBLE_EQ(belief.state().effective_track, 0.5621) << "ten minutes at constant speed";
}

/// A body that sticks, a gyro that is absent, has another unit or reads a third is no slip.
TEST(SlipBelief, LearnsNothingFromATurnBeyondTheRange) {
  const double asked = kRadius * 5.0 / 0.5621;
  for (const double part : {0.0, 1.0 / 3.0, -1.0, 3.0, 57.3}) {
    SlipBelief belief(kConfigured, kRadius, {});
    for (int k = 0; k < 500; ++k) belief.learnTrack(part * asked, 0.0, {5.0, 0.0, 0.0, 0.0, 2.0, 0.0}, kPeriod);
    EXPECT_EQ(belief.effectiveTrack(), 0.5621) << part;
    EXPECT_EQ(belief.turn().mean()(1), 0.0) << part;
  }
}

/// In an arc the lateral acceleration v theta_dot tells slippery ground from a gyro that reads half.
TEST(SlipBelief, LearnsNoSlipThatTheLateralAccelerationContradicts) {
  constexpr double v = 1.0, gyro = 0.75;  // m/s; of the yaw rate of the wheels
  const struct {
    const char* name;
    double lateral;  // of v times the yaw rate of the wheels
    bool learns;
  } rows[] = {{"slippery ground", gyro, true},
              {"no accelerometer", 0.0, true},
              {"banked ground, inclined inwards", gyro - 0.5, true},
              {"a body that turns twice as fast as the gyro reads", 2.0 * gyro, false}};
  const double asked = kRadius * 5.0 / 0.5621;
  for (const auto& row : rows) {
    SlipBelief belief(kConfigured, kRadius, {});
    std::mt19937 random(3);
    std::normal_distribution<double> noise(0.0, 0.3);  // m/s^2
    for (int k = 0; k < 500; ++k) {
      const double lateral = row.lateral == 0.0 ? 0.0 : v * row.lateral * asked + noise(random);
      belief.learnTrack(gyro * asked, lateral, {5.0, 1e-4, 0.0, 0.0, v / kRadius, 0.0}, kPeriod);
    }
    EXPECT_NEAR(belief.turn().perDifference(0.5, v), (row.learns ? gyro : 1.0) / 0.5621, 0.03 / 0.5621) << row.name;
  }
}

TEST(SlipBelief, WithdrawsTheLastTurnsOfAFaultySensor) {
  SlipBelief belief(kConfigured, kRadius, {});
  SlippingRobot robot({0.65, 1.0}, belief);
  for (int i = 0; i < 10; ++i) robot.drive(0.5, i % 2 == 0 ? 0.6 : -0.6, 2.0);
  EXPECT_NEAR(belief.effectiveTrack(), 0.65, 0.03);
  const double asked = kRadius * 5.0 / 0.65;
  for (int k = 0; k < 50; ++k) belief.learnTrack(0.7 * asked, 0.0, {5.0, 0.0, 0.0, 0.0, 0.0, 0.0}, kPeriod);
  EXPECT_GT(belief.effectiveTrack(), 0.75);
  belief.withdraw();
  EXPECT_NEAR(belief.effectiveTrack(), 0.65, 0.03);
}

/// Largest relative error of a track that is right, in a turn that wheels and body enter with these time constants [s],
/// while the model expects 0.03 s of the wheels.
double largestTrackError(double of_wheels, double of_body) {
  SlipBelief belief(kConfigured, kRadius, {});
  double wheels = 0.0, believed = 0.0, yaw_rate = 0.0, largest = 0.0;
  for (int k = 0; k < 100; ++k) {
    const auto part = [](double time) { return time > 0.0 ? -std::expm1(-kPeriod / time) : 1.0; };
    wheels += (2.0 - wheels) * part(of_wheels);
    believed += (2.0 - believed) * part(0.03);
    const double rate = (2.0 - believed) / 0.03;
    yaw_rate += (kRadius * wheels / 0.5621 - yaw_rate) * part(of_body);
    belief.learnTrack(yaw_rate, 0.0, {believed, 2e-4, rate, wheels - believed, 0.0, 0.0}, kPeriod);
    believed += 0.3 * (wheels - believed);
    largest = std::max(largest, std::abs(belief.effectiveTrack() / 0.5621 - 1.0));
  }
  return largest;
}

TEST(SlipBelief, SlowMotorsAndTyresAreNoSlip) {
  EXPECT_LT(largestTrackError(0.15, 0.0), 0.06);
  EXPECT_LT(largestTrackError(0.03, 0.1), 0.3);
}

TEST(SlipBelief, LearnsHowTheTurnDependsOnTheSpeedAndKeepsItInItsState) {
  // Two grounds in one: turning in place and turning at speed, each for longer than the correction remembers.
  SlipBelief belief(kConfigured, kRadius, {}), kept(belief);
  SlippingRobot slow({0.6, 1.0}, belief), fast({0.5, 1.0}, belief);
  for (int i = 0; i < 10; ++i) {
    slow.drive(0.0, 0.6, 2.0);
    EXPECT_NEAR(belief.yawRate(-1.8, 1.8), 0.6, 0.02);
    fast.drive(1.0, 0.6, 2.0);
    EXPECT_NEAR(belief.yawRate(8.7, 11.7), 0.6, 0.02);
  }
  const WheelCommand wheels = belief.wheelSpeeds(0.0, 0.6);
  EXPECT_NEAR(wheels.right - wheels.left, 0.6 * 0.6 / kRadius, 0.05 * 0.6 * 0.6 / kRadius)
      << "turning in place is known again although the robot came from a fast turn";
  kept.setState(belief.state());
  slow.drive(0.0, 0.0, 10.0);  // until what the ground did last has faded
  EXPECT_NEAR(kept.effectiveTrack(), belief.effectiveTrack(), 1e-3);
  for (const double mean : {0.0, 5.0, 10.0}) {
    EXPECT_NEAR(kept.yawRate(mean - 2.0, mean + 2.0), belief.yawRate(mean - 2.0, mean + 2.0), 1e-3);
  }
  kept.setState({0.55, 1.0});
  EXPECT_DOUBLE_EQ(kept.yawRate(8.0, 12.0), kRadius * 4.0 / 0.55) << "a state without it is one track";
}

}  // namespace
}  // namespace jackal_aic
