#include "jackal_aic/faults/yaw_belief.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "jackal_aic/model/square.hpp"

namespace jackal_aic {
namespace {

constexpr double kTrack = 0.55;          // m
constexpr double kSlope = 1.0 / kTrack;  // 1/m

/// Of a parameter set in which every number tells itself from the others.
constexpr YawBeliefParameters kParameters{4e-5, 0.1, 0.04, 0.03};

/// Variance of s [1/m^2].
double slopeVariance(const YawBelief& belief) { return belief.variance(1.0, 0.0) - belief.variance(0.0, 0.0); }

TEST(YawBelief, BeginsWithWhatAnyRobotMayBe) {
  const YawBelief belief(kTrack, kParameters);
  EXPECT_DOUBLE_EQ(belief.slope(), kSlope);
  EXPECT_NEAR(belief.variance(0.5, 1e-4), square(0.5 * 0.3 * kSlope) + square(0.03) + 4e-5 + square(kSlope) * 1e-4,
              1e-12);
  EXPECT_DOUBLE_EQ(belief.biasVariance(), square(0.03));
}

TEST(YawBelief, CorrectsAsASchmidtKalmanFilter) {
  YawBelief belief(kTrack, kParameters);
  const double x = 0.5, noise = 2.0 * (4e-5 + square(kSlope) * 1e-3), variance = square(0.3 * kSlope);
  const double gain = x * variance / (square(x) * variance + square(0.03) + noise);
  belief.correct(kSlope * x + 0.1, x, 1e-3, 2.0);
  EXPECT_NEAR(belief.slope(), kSlope + 0.1 * gain, 1e-12);
  EXPECT_NEAR(slopeVariance(belief), variance * (1.0 - gain * x), 1e-12);
  EXPECT_EQ(belief.bias(), 0.0);
}

TEST(YawBelief, LearnsTheBiasByAScalarFilterOnceTheMotionHasSettled) {
  YawBelief belief(kTrack, kParameters);
  belief.correct(0.1, 0.0, 1e-3, 2.0, false);
  EXPECT_EQ(belief.bias(), 0.0);
  const double gain = square(0.03) / (square(0.03) + 2.0 * (4e-5 + square(kSlope) * 1e-3));
  belief.correct(0.1, 0.0, 1e-3, 2.0);
  EXPECT_NEAR(belief.bias(), 0.1 * gain, 1e-12);
  EXPECT_NEAR(belief.biasVariance(), square(0.03) * (1.0 - gain), 1e-12);
  EXPECT_DOUBLE_EQ(belief.slope(), kSlope);
}

TEST(YawBelief, TheBiasIsToldApartWhereTheSlipSaysLessThanTheNoise) {
  const double limit = std::sqrt(4e-5) / (0.1 * kSlope);  // of x [m/s]
  YawBelief slow(kTrack, kParameters), fast(kTrack, kParameters);
  slow.correct(kSlope * limit * 0.95 + 0.1, limit * 0.95, 0.0, 1.0);
  fast.correct(kSlope * limit * 1.05 + 0.1, limit * 1.05, 0.0, 1.0);
  EXPECT_GT(slow.bias(), 0.05);
  EXPECT_DOUBLE_EQ(slow.slope(), kSlope);
  EXPECT_EQ(fast.bias(), 0.0);
  EXPECT_GT(fast.slope(), kSlope);
}

TEST(YawBelief, TimeAndChangesOfTheMotionMakeItLessSure) {
  YawBelief belief(kTrack, kParameters);
  for (int k = 0; k < 1000; ++k) belief.correct(kSlope, 1.0, 0.0, 1.0);
  for (int k = 0; k < 1000; ++k) belief.correct(0.0, 0.0, 0.0, 1.0);
  const double slope = slopeVariance(belief), bias = belief.biasVariance();
  belief.predict(0.0, 0.5, 1.0);
  EXPECT_NEAR(slopeVariance(belief) - slope, square(0.04 * kSlope), 1e-9) << "a second";
  EXPECT_NEAR(belief.biasVariance() - bias, 1e-6, 1e-12);
  belief.predict(0.3, 0.5, 0.1, 0.01);
  EXPECT_NEAR(slopeVariance(belief) - slope, 1.1 * square(0.04 * kSlope) + square(0.3 * 0.1 * kSlope) * 0.2, 1e-9);
  EXPECT_NEAR(belief.biasVariance() - bias, 1.1e-6 + square(0.01) * 0.2, 1e-12);
  belief.predict(100.0, 0.5, 100.0, 100.0);
  EXPECT_NEAR(slopeVariance(belief), square(0.3 * kSlope), 1e-9) << "no less than at the start";
  EXPECT_DOUBLE_EQ(belief.biasVariance(), square(0.03));
}

TEST(YawBelief, InflatedItKnowsWhatButNotHowWell) {
  YawBelief belief(kTrack, kParameters);
  for (int k = 0; k < 1000; ++k) belief.correct(1.2 * kSlope, 1.0, 0.0, 1.0);
  belief.inflate(0.5);
  EXPECT_NEAR(belief.relativeSlope(), 1.2, 0.01);
  EXPECT_NEAR(slopeVariance(belief), square(0.3 * kSlope), 1e-9);
  EXPECT_DOUBLE_EQ(belief.biasVariance(), 0.25);
}

TEST(YawBelief, TheSlipIsNeverMoreThanTwiceOffTheGivenOne) {
  for (const double slip : {3.0, 0.2}) {
    YawBelief belief(kTrack, kParameters);
    for (int k = 0; k < 1000; ++k) {
      belief.predict(1.0, 0.5, 0.02);
      belief.correct(slip * kSlope, 1.0, 0.0, 1.0);
    }
    EXPECT_DOUBLE_EQ(belief.relativeSlope(), slip > 1.0 ? 2.0 : 0.5);
  }
}

}  // namespace
}  // namespace jackal_aic
