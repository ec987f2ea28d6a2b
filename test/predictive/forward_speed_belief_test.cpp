#include "jackal_aic/predictive/forward_speed_belief.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;
constexpr double kVariance = 2.5e-3;

TEST(ForwardSpeedBelief, WithoutWeightIsThatOfTheWheels) {
  ForwardSpeedBelief belief({0.0, 0.1});
  belief.correct(0.5, 3.0, kVariance, 1.0, kPeriod);
  EXPECT_EQ(belief.difference(), 0.0);
  EXPECT_EQ(belief.variance(), 0.0);
}

TEST(ForwardSpeedBelief, AgreesWithWheelsThatGrip) {
  ForwardSpeedBelief belief({0.9, 0.0});
  for (int k = 1; k <= 50; ++k) belief.correct(1.5 * k * kPeriod, 1.5, kVariance, 0.0, kPeriod);
  EXPECT_NEAR(belief.difference(), 0.0, 1e-12);
}

TEST(ForwardSpeedBelief, StaysBehindWheelsThatSpinUntilItsMemoryFades) {
  ForwardSpeedBelief belief({0.98, 0.0});
  belief.correct(0.0, 0.0, kVariance, 0.0, kPeriod);
  belief.correct(1.0, 1.0, kVariance, 0.0, kPeriod);
  EXPECT_NEAR(belief.difference(), -0.98 * 0.98, 1e-12) << "the body gained 0.02 m/s, the wheels 1 m/s";
  for (int k = 0; k < 500; ++k) belief.correct(1.0, 0.0, kVariance, 0.0, kPeriod);
  EXPECT_NEAR(belief.difference(), 0.0, 1e-4);
}

TEST(ForwardSpeedBelief, CentripetalAccelerationIsNoChangeOfSpeed) {
  constexpr double kCentre = 0.05, kYawRate = 2.0;  // IMU behind the centre of turning: it is pulled forward
  ForwardSpeedBelief knows({0.9, kCentre}), does_not({0.9, 0.0});
  for (ForwardSpeedBelief* belief : {&knows, &does_not}) {
    for (int k = 0; k < 100; ++k) belief->correct(0.3, kCentre * kYawRate * kYawRate, kVariance, kYawRate, kPeriod);
  }
  EXPECT_NEAR(knows.difference() - 0.0, -0.3 * std::pow(0.9, 100), 1e-12);
  EXPECT_GT(does_not.difference(), 0.03);
}

TEST(ForwardSpeedBelief, VarianceIsThatOfFilteredNoise) {
  ForwardSpeedBelief belief({0.9, 0.0});
  for (int k = 0; k < 200; ++k) belief.correct(0.0, 0.0, kVariance, 0.0, kPeriod);
  EXPECT_NEAR(belief.variance(), 0.81 / (1.0 - 0.81) * kPeriod * kPeriod * kVariance, 1e-12);
}

TEST(ForwardSpeedBelief, AfterAGapBelievesTheWheels) {
  ForwardSpeedBelief belief({0.9, 0.0});
  belief.correct(0.0, 5.0, kVariance, 0.0, kPeriod);
  ASSERT_NE(belief.difference(), 0.0);
  belief.correct(0.4, 5.0, kVariance, 0.0, 0.5);
  EXPECT_EQ(belief.difference(), 0.0);
  belief.correct(0.4, 0.0, kVariance, 0.0, kPeriod);
  EXPECT_EQ(belief.difference(), 0.0) << "compared with the wheels after the gap";
}

}  // namespace
}  // namespace jackal_aic
