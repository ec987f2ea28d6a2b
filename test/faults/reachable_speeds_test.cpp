#include "jackal_aic/faults/reachable_speeds.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "jackal_aic/model/wheel_belief.hpp"

namespace jackal_aic {
namespace {

constexpr double kRadius = 0.098;  // m

PlantModel model() {
  PlantModel m;
  m.dead_time = 0.08;
  m.lag = 0.02;
  m.acceleration_limit = 1.65;
  return m;
}

constexpr DriveTrainRange kRange{0.04, 0.09, 0.01, 0.1, 0.5, 3.0};

/// A drive train somewhere in the range.
PlantModel drawn(std::mt19937& random) {
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  PlantModel m = model();
  m.dead_time += std::round(1e3 * between(-kRange.earlier, kRange.later)) / 1e3;
  m.lag = between(kRange.shortest_lag, kRange.longest_lag);
  m.acceleration_limit *= between(kRange.slowest_acceleration, kRange.fastest_acceleration);
  return m;
}

TEST(ReachableSpeeds, HoldEveryDriveTrainOfTheirRange) {
  std::mt19937 random(1);
  for (int robot = 0; robot < 50; ++robot) {
    ReachableSpeeds reachable(model(), kRadius, kRange);
    WheelBelief wheel(drawn(random), kRadius, {});
    std::normal_distribution<double> draw(0.0, 8.0);
    double command = 0.0;
    int hold = 0;
    for (int k = 0; k < 10000; ++k) {
      if (--hold <= 0) {
        command = draw(random);
        hold = 1 + static_cast<int>(random() % 500);
      }
      wheel.predict(command);
      const Range rates = reachable.predict(command);
      ASSERT_GE(wheel.speed(), reachable.speeds().low - 1e-9) << "robot " << robot << ", step " << k;
      ASSERT_LE(wheel.speed(), reachable.speeds().high + 1e-9) << "robot " << robot << ", step " << k;
      ASSERT_GE(wheel.acceleration(), rates.low - 1e-6) << "robot " << robot << ", step " << k;
      ASSERT_LE(wheel.acceleration(), rates.high + 1e-6) << "robot " << robot << ", step " << k;
    }
  }
}

TEST(ReachableSpeeds, HoldAWheelThatTurnsByTheOffsetSlowerOrStands) {
  PlantModel with = model();
  with.offset = 0.5;
  ReachableSpeeds reachable(with, kRadius, kRange);
  for (int k = 0; k < 2999; ++k) reachable.predict(-10.0);
  const Range rates = reachable.predict(-10.0);
  EXPECT_NEAR(rates.low, 0.0, 1e-3);
  EXPECT_NEAR(rates.high, 0.0, 1e-3);
  EXPECT_NEAR(reachable.speeds().low, -9.5, 1e-6);
  EXPECT_NEAR(reachable.speeds().high, -9.5, 1e-6);
  reachable.start(0.0);
  for (int k = 0; k < 3000; ++k) reachable.predict(0.4);
  EXPECT_EQ(reachable.speeds().high, 0.0);
}

TEST(ReachableSpeeds, AreTheModelsWithoutUncertainty) {
  ReachableSpeeds reachable(model(), kRadius, {0.0, 0.0, 0.02, 0.02, 1.0, 1.0});
  WheelBelief wheel(model(), kRadius, {});
  for (int k = 0; k < 2000; ++k) {
    const double command = k < 1000 ? 6.0 : -4.0;
    wheel.predict(command);
    reachable.predict(command);
    EXPECT_NEAR(reachable.speeds().low, wheel.speed(), 1e-6);
    EXPECT_NEAR(reachable.nominal(), wheel.speed(), 1e-6);
    EXPECT_NEAR(reachable.speeds().high, wheel.speed(), 1e-6);
  }
}

TEST(ReachableSpeeds, OfAWheelThatMayHaveSettledHoldWhereItsCommandsLead) {
  ReachableSpeeds reachable(model(), kRadius, kRange);
  for (int k = 0; k < 1000; ++k) reachable.predict(10.0);
  reachable.seed(9.5, 1.0);
  EXPECT_EQ(reachable.speeds().low, 9.5);
  EXPECT_EQ(reachable.nominal(), 9.5);
  EXPECT_EQ(reachable.speeds().high, 10.0);
  reachable.seed(10.5, 1.0);
  EXPECT_EQ(reachable.speeds().low, 10.0);
  EXPECT_EQ(reachable.speeds().high, 10.5);
  for (const double under_way : {8.5, 11.5, 0.0, -10.0}) {
    reachable.seed(under_way, 1.0);
    EXPECT_EQ(reachable.speeds().low, under_way);
    EXPECT_EQ(reachable.speeds().high, under_way);
  }
}

}  // namespace
}  // namespace jackal_aic
