#include "jackal_aic/faults/channel_monitor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace jackal_aic {
namespace {

constexpr double kStep = 0.02;

TEST(ChebyshevBound, HoldsForAnyDistribution) {
  // Two-valued errors that reach the bound exactly: +-d with probability alpha/2 each, else 0, have variance alpha d^2
  // = 1.
  for (double alpha : {0.01, 0.04, 0.2}) EXPECT_DOUBLE_EQ(alpha * std::pow(chebyshevBound(1, alpha), 2), 1.0);
  EXPECT_DOUBLE_EQ(chebyshevBound(1, 0.04), 5.0);
  EXPECT_DOUBLE_EQ(chebyshevBound(2, 0.04), std::sqrt(50.0));
}

TEST(LearnedVariance, FindsTheFactorOfTheNoise) {
  std::mt19937 random(1);
  for (double deviation : {1.0, 3.0, 5.0}) {
    LearnedVariance learned;
    std::normal_distribution<double> noise(0.0, deviation * 0.1);
    double mean = 0.0;
    for (int k = 0; k < 2000; ++k) {
      learned.learn(noise(random), 0.01, SampleStep(kStep, 2.0).share);
      if (k >= 1000) mean += learned.factor() / 1000.0;
    }
    EXPECT_NEAR(mean, deviation * deviation, 0.15 * deviation * deviation);
    EXPECT_NEAR(learned.squaredDistance(1.0, 0.01), 100.0 / learned.factor(), 1e-9);
  }
}

TEST(LearnedVariance, StaysWithinItsBounds) {
  LearnedVariance learned;
  const double share = SampleStep(kStep, 0.1).share;
  for (int k = 0; k < 200; ++k) learned.learn(0.0, 1.0, share);
  EXPECT_EQ(learned.factor(), 1.0);
  for (int k = 0; k < 200; ++k) learned.learn(1e3, 1.0, share);
  EXPECT_EQ(learned.factor(), LearnedVariance::kLargestFactor);
}

TEST(RecentChange, CountsAChangeTheSameInOneStepOrMany) {
  RecentChange slow(0.5), fast(0.5), jitter(0.5);
  for (int k = 0; k < 100; ++k) {
    slow.add(1.0, 0.001);  // 0.1 within 0.1 s
    fast.add(k == 50 ? 100.0 : 0.0, 0.001);
    jitter.add(k % 2 == 0 ? 100.0 : -100.0, 0.001);
  }
  EXPECT_NEAR(slow.value(), 0.1, 0.01);
  EXPECT_NEAR(fast.value(), 0.1, 0.01);
  EXPECT_NEAR(jitter.value(), 0.0, 0.1);
  for (int k = 0; k < 500; ++k) slow.add(0.0, 0.001);
  EXPECT_NEAR(slow.value(), 0.09 * std::exp(-1.0), 0.01) << "and forgets it";
}

TEST(Persistence, SingleOutliersAreNoFault) {
  Persistence channel({5, 8, 1.0});
  for (int k = 0; k < 1000; ++k) {
    const bool suspect = k % 2 == 0;  // 4 of 8
    EXPECT_EQ(channel.update(suspect, true, kStep), suspect ? ChannelState::outlier : ChannelState::ok);
  }
}

TEST(Persistence, EnoughOutliersInTheWindowAreAFault) {
  Persistence channel({5, 8, 1.0});
  const bool pattern[] = {true, true, false, true, false, true};
  for (bool suspect : pattern) EXPECT_NE(channel.update(suspect, true, kStep), ChannelState::faulty);
  EXPECT_EQ(channel.update(true, true, kStep), ChannelState::faulty);
}

TEST(Persistence, WorksWithTheLargestWindow) {
  Persistence channel({64, 64, 1.0});
  for (int k = 0; k < 63; ++k) EXPECT_EQ(channel.update(true, true, kStep), ChannelState::outlier);
  EXPECT_EQ(channel.update(true, true, kStep), ChannelState::faulty);
}

TEST(Persistence, RecoversAfterGoodSamplesThatSaySomething) {
  Persistence channel({2, 2, 1.0});
  channel.update(true, true, kStep);
  ASSERT_EQ(channel.update(true, true, kStep), ChannelState::faulty);
  for (int k = 0; k < 200; ++k) EXPECT_EQ(channel.update(false, false, kStep), ChannelState::faulty) << "says nothing";
  for (int k = 0; k < 40; ++k) EXPECT_EQ(channel.update(false, true, kStep), ChannelState::faulty);
  EXPECT_EQ(channel.update(true, true, kStep), ChannelState::faulty) << "a relapse";
  int needed = 0;
  while (channel.update(false, true, kStep) == ChannelState::faulty) ++needed;
  EXPECT_NEAR(needed, 49, 1) << "a second again";
  EXPECT_EQ(channel.update(true, true, kStep), ChannelState::outlier) << "and the window starts empty";
}

TEST(Persistence, ADeclarationStartsTheRecoveryAnew) {
  Persistence channel({5, 8, 1.0});
  const auto goodSamples = [&](int count) {
    for (int k = 0; k < count; ++k) channel.update(false, true, kStep);
    return channel.state();
  };
  channel.declareFaulty();
  EXPECT_EQ(goodSamples(40), ChannelState::faulty);
  channel.declareFaulty();
  EXPECT_EQ(goodSamples(40), ChannelState::faulty) << "0.8 s since it was declared again";
  EXPECT_EQ(goodSamples(11), ChannelState::ok);
  channel.declareFaulty();
  EXPECT_EQ(goodSamples(40), ChannelState::faulty) << "as the first time";
}

TEST(Persistence, ResetForgetsTheSamples) {
  Persistence channel({5, 8, 1.0});
  for (int k = 0; k < 4; ++k) channel.update(true, true, kStep);
  EXPECT_TRUE(channel.suspecting());
  channel.reset();
  EXPECT_FALSE(channel.suspecting());
  EXPECT_EQ(channel.update(true, true, kStep), ChannelState::outlier) << "one of one";
}

TEST(MissedMotion, FindsARunThatOutlastsTheMotion) {
  MissedMotion test;
  EXPECT_FALSE(test.update(5.0, false, 4.9, 5.1, 0.3, kStep));
  for (int k = 0; k < 1000; ++k) EXPECT_FALSE(test.update(5.0, true, 4.9, 5.1, 0.3, kStep)) << "nothing to miss";
  int samples = 0;
  while (!test.update(5.0, true, 6.0, 6.2, 0.3, kStep) && samples < 100) ++samples;
  EXPECT_LE(samples * kStep, 0.25);
  EXPECT_FALSE(test.update(6.1, false, 6.0, 6.2, 0.3, kStep)) << "it lives again";
}

TEST(MissedMotion, ASourceThatIsRenewedNowAndThenIsAlive) {
  MissedMotion test;
  for (int k = 0; k < 1000; ++k) {
    const double speed = 0.3 * k;  // renewed at 10 Hz
    EXPECT_FALSE(test.update(0.3 * (k - k % 5), k % 5 != 0, speed - 0.1, speed + 0.1, 0.3, kStep)) << k;
  }
}

TEST(MissedMotion, AValueThatWasThereBeforeItsPredictionMissesNothing) {
  MissedMotion test;
  test.update(6.0, false, 4.0, 5.0, 0.3, kStep);
  for (int k = 0; k < 1000; ++k) EXPECT_FALSE(test.update(6.0, true, 5.9, 6.1, 0.3, kStep));
}

TEST(MissedMotion, IsFoundInBothDirections) {
  for (const double way : {1.0, -1.0}) {
    const auto missesAll = [way](double value, double from, double to) {
      MissedMotion test;
      const auto update = [&](double y, bool repeats, double at) {
        return test.update(way * y, repeats, way * at - 0.1, way * at + 0.1, 0.3, kStep);
      };
      update(value, false, from);
      bool missed = false;
      for (int k = 0; k < 20; ++k) missed = update(value, true, to);
      return missed;
    };
    EXPECT_TRUE(missesAll(5.0, 5.0, 6.0)) << way;
    EXPECT_TRUE(missesAll(5.0, 5.0, 3.0)) << way;
    EXPECT_FALSE(missesAll(6.0, 5.0, 6.0)) << way << ": it was there before";
    EXPECT_FALSE(missesAll(3.0, 5.0, 3.0)) << way;
  }
}

TEST(MissedMotion, WhatTakesLongerThanSecondsMayBeTheDriveTrain) {
  const auto missed = [](double rate) {  // [1/s]
    MissedMotion test;
    test.update(5.0, false, 4.9, 5.1, 0.3, kStep);
    bool result = false;
    for (int k = 1; k <= 1000; ++k) {
      const double at = 5.0 + rate * kStep * k;
      result |= test.update(5.0, true, at - 0.1, at + 0.1, 0.3, kStep);
    }
    return result;
  };
  for (const double way : {1.0, -1.0}) {
    EXPECT_FALSE(missed(0.08 * way)) << "1.6 in 20 s";
    EXPECT_TRUE(missed(0.15 * way)) << "3 in 20 s";
  }
}

/// A source that is renewed now and then misses motion in between. @param samples between renewals; @returns after how
/// many of them it is found frozen at last, when it has been renewed some times.
int samplesUntilMissed(int renewals, int samples) {
  MissedMotion test;
  double at = 0.0;
  bool missed = false;
  for (int k = 0; k < renewals; ++k) {
    test.update(at, false, at, at, 0.3, kStep);
    for (int i = 1; i < samples; ++i) missed |= test.update(at, true, at + 1.0, at + 1.0, 0.3, kStep);
    at += 1.0;
  }
  if (missed) return 0;
  test.update(at, false, at, at, 0.3, kStep);
  int count = 1;
  while (!test.update(at, true, at + 1.0, at + 1.0, 0.3, kStep)) ++count;
  return count;
}

TEST(MissedMotion, IsGivenTwiceTheLongestTimeThatItTookBefore) {
  EXPECT_NEAR(samplesUntilMissed(3, 1) * kStep, 0.26, 0.021) << "hardly known: the longest patience";
  EXPECT_NEAR(samplesUntilMissed(30, 1) * kStep, 0.12, 0.021) << "known to be renewed all the time";
  EXPECT_NEAR(samplesUntilMissed(30, 5) * kStep, 0.18, 0.021) << "renewed at 10 Hz, misses 0.08 s";
  EXPECT_NEAR(samplesUntilMissed(30, 10) * kStep, 0.26, 0.021) << "renewed at 5 Hz: the longest patience";
}

TEST(MissedMotion, ASourceThatWasRenewedSeldomWhileItCreptIsWaitedForWhenItDrivesOff) {
  constexpr double kPublished = 0.05;  // s
  constexpr int kHeldSamples = 5;      // renewed at 4 Hz
  MissedMotion test;
  double measured = 0.0;
  const auto isMissed = [&](int k, double speed) {
    const bool renewed = k % kHeldSamples == 0;
    if (renewed) measured = speed;
    return test.update(measured, !renewed, speed, speed, 0.3, kPublished);
  };
  for (int k = 0; k < 200; ++k) EXPECT_FALSE(isMissed(k, 0.6 + 0.02 * (k / kHeldSamples % 2))) << k;
  for (int k = 0; k < 100; ++k) EXPECT_FALSE(isMissed(k, 0.6 + 0.2 * k)) << k << ", under way";
}

TEST(MissedMotion, ForgetsWhatWasUncertainWhenTheValueChangedLast) {
  MissedMotion test;
  test.update(5.0, false, 1.0, 9.0, 0.3, kStep);
  for (int k = 0; k < 100; ++k) EXPECT_FALSE(test.update(5.0, true, 4.9, 5.1, 0.3, kStep)) << "nothing to miss";
  int samples = 0;
  while (!test.update(5.0, true, 4.0, 4.2, 0.3, kStep) && samples < 100) ++samples;
  EXPECT_LE(samples * kStep, 0.26);
}

TEST(MissedMotion, IsNoneToAndFroBetweenTwoRenewals) {
  constexpr double kHold = 0.24;
  MissedMotion test;
  for (int k = 0; k < 20; ++k) test.update(0.5 * k, false, 0.5 * k, 0.5 * k, 0.3, kStep, kHold);
  test.update(9.5, false, 8.6, 8.6, 0.3, kStep, kHold);  // a wheel that is faster than its model by a tenth
  for (int k = 0; k < 500; ++k) {
    const double at = k >= 50 && k < 62 ? 9.5 : 8.6;
    EXPECT_FALSE(test.update(9.5, true, at, at, 0.3, kStep, kHold)) << k;
  }
}

TEST(MissedMotion, UncertainMotionIsNone) {
  MissedMotion test;
  test.update(4.5, false, 4.0, 5.0, 0.3, kStep);
  for (int k = 0; k < 1000; ++k) EXPECT_FALSE(test.update(4.5, true, 4.9, 9.0, 0.3, kStep)) << "it may be where it was";
}

/// Time for which a ramp [unit/s] is held between renewals as an encoder learns it.
double holdOfRamp(double slope, double period, int samples_per_renewal) {
  SampleHold hold;
  for (int i = 0; i < 100; ++i) hold.update(slope * period * (i / samples_per_renewal), 0.1, period);
  return hold.longest();
}

TEST(SampleHold, LearnsForHowLongAnEncoderHoldsItsValue) {
  EXPECT_NEAR(holdOfRamp(4.0, 0.05, 5), 0.2, 1e-9) << "renewed at 4 Hz, published at 20";
  EXPECT_EQ(holdOfRamp(4.0, 0.05, 1), 0.0) << "every sample is a new one";
  EXPECT_EQ(holdOfRamp(40.0, 0.05, 20), 0.0) << "what lasts that long is no renewal";
}

TEST(SampleHold, UntilItIsKnownTheLongestSoFarCounts) {
  SampleHold hold;
  for (int i = 0; i < 12; ++i) hold.update(1.0 * (i / 5), 0.1, 0.05);
  EXPECT_NEAR(hold.longest(), 0.2, 1e-9) << "two renewals";
}

TEST(SampleHold, StandingStillIsNoHold) {
  SampleHold hold;
  for (int i = 0; i < 200; ++i) hold.update(i % 20 < 10 ? 1.0 : 2.0, 0.1, 0.02);
  EXPECT_EQ(hold.longest(), 0.0);
}

TEST(SampleHold, OnlyMotionThatGoesOnTellsOfAHold) {
  SampleHold hold;
  double value = 0.0;
  for (int i = 0; i < 100; ++i) {  // stands, shivers, goes up, stands, ...
    if (i % 10 == 0) value += 0.05;
    if (i % 10 == 5) value += 1.0;
    hold.update(value, 0.1, 0.02);
  }
  EXPECT_EQ(hold.longest(), 0.0);
}

TEST(MissedMotion, WaitsForAnEncoderThatHoldsItsValue) {
  const auto missedAfter = [](double hold) {
    MissedMotion motion;
    for (int i = 0; i < 20; ++i) motion.update(0.01 * i, false, 0.01 * i, 0.01 * i, 0.1, 0.02);
    for (int i = 1; i < 100; ++i) {
      if (motion.update(0.19, true, 5.0, 5.0, 0.1, 0.02, hold)) return 0.02 * i;
    }
    return 1e9;
  };
  EXPECT_LT(missedAfter(0.0), 0.2);
  EXPECT_GT(missedAfter(0.2), 0.4);
  EXPECT_LT(missedAfter(0.2), 0.6);
}

}  // namespace
}  // namespace jackal_aic
