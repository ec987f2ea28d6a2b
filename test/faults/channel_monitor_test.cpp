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

TEST(TimingVariance, IsTheSquareOfWhatADelayDoesToARamp) {
  TimingVariance timing(0.03);
  for (int k = 0; k < 300; ++k) timing.add(10.0, 0.001);
  EXPECT_NEAR(timing.value(), std::pow(0.03 * 10.0, 2), 0.01);
  for (int k = 0; k < 100; ++k) timing.add(0.0, 0.001);
  EXPECT_GT(timing.value(), 0.02) << "what comes late is still on its way";
  for (int k = 0; k < 1000; ++k) timing.add(0.0, 0.001);
  EXPECT_LT(timing.value(), 1e-4);
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

class Repetition : public testing::Test {
 protected:
  /// Samples of noise, rounded to a quantum if there is one; true if one was suspect.
  bool feedNoise(RepetitionTest& test, int samples, double quantum) {
    bool suspect = false;
    for (int k = 0; k < samples; ++k) {
      const double value = 5.0 + noise_(random_);
      suspect |= test.update(quantum > 0.0 ? quantum * std::round(value / quantum) : value, false, 1e-5);
    }
    return suspect;
  }

  std::mt19937 random_{3};
  std::normal_distribution<double> noise_{0.0, 0.03};
};

TEST_F(Repetition, FindsAFrozenSensor) {
  RepetitionTest test(8);
  EXPECT_FALSE(feedNoise(test, 500, 0.0));
  test.update(5.02, false, 1e-5);
  for (int k = 1; k < 8; ++k) EXPECT_FALSE(test.update(5.02, false, 1e-5)) << k;
  EXPECT_TRUE(test.update(5.02, false, 1e-5));
  EXPECT_TRUE(test.update(5.02, false, 1e-5));
  EXPECT_FALSE(test.update(5.03, false, 1e-5)) << "it lives again";
}

TEST_F(Repetition, LearnsThatAQuantisedSensorRepeats) {
  RepetitionTest test(8);
  EXPECT_FALSE(feedNoise(test, 30000, 0.01));  // repeats about every tenth sample
  EXPECT_NEAR(test.quantum(), 0.01, 1e-9);
  test.update(5.0, false, 1e-5);
  int needed = 1;
  while (!test.update(5.0, false, 1e-5) && needed < 100) ++needed;
  EXPECT_GT(needed, 8);
  EXPECT_LT(needed, 15) << "freezing is still found, later";
}

/// Noise of one and a half steps, as a low-pass leaves it of a fine encoder: known by many samples, not by its size.
TEST_F(Repetition, NoiseThatIsHardlyFinerThanTheResolutionIsEnoughInTheEnd) {
  constexpr double kQuantum = 0.02;
  int found = 0;
  for (int run = 0; run < 100; ++run) {
    RepetitionTest test(8);
    EXPECT_FALSE(feedNoise(test, 300, kQuantum));
    bool suspect = false;
    for (int k = 0; k < 25; ++k) suspect = test.update(5.0, false, 1e-5);
    found += suspect ? 1 : 0;
  }
  EXPECT_GE(found, 95) << "within half a second at 50 Hz";
  RepetitionTest healthy(8);
  EXPECT_FALSE(feedNoise(healthy, 1000000, kQuantum)) << "five and a half hours";
}

TEST_F(Repetition, BelowTheResolutionNoiseSaysNothing) {
  for (double quantum : {0.0606, 0.1}) {
    RepetitionTest test(8);
    EXPECT_FALSE(feedNoise(test, 30000, quantum));
    for (int k = 0; k < 3000; ++k) ASSERT_FALSE(test.update(5.0, false, 1e-5)) << "in the middle of a step it stays";
  }
}

TEST_F(Repetition, ShovesOfTheGroundAreNoNoise) {
  RepetitionTest test(8);
  for (int shove = 0; shove < 20; ++shove) {
    for (int k = 0; k < 10; ++k) EXPECT_FALSE(test.update(9.0 + (k % 2 == 0 ? 0.24 : -0.24), false, 1e-5));
    for (int k = 0; k < 300; ++k) ASSERT_FALSE(test.update(9.0, false, 1e-5)) << shove << ", sample " << k;
  }
}

TEST_F(Repetition, TheFirstRunCondemnsNobody) {
  RepetitionTest test(8);
  for (int k = 0; k < 100; ++k) EXPECT_FALSE(test.update(5.0, false, 1e-5));
}

TEST_F(Repetition, MotionIsNoNoise) {
  RepetitionTest test(8);
  for (int k = 0; k < 60; ++k) EXPECT_FALSE(test.update(0.0065 * std::round(0.3 * k / 0.0065), false, 1e-5, 0.3));
  for (int k = 0; k < 3000; ++k) ASSERT_FALSE(test.update(17.7, false, 1e-5, 0.0)) << "a ramp that ends without noise";
}

TEST_F(Repetition, NoiseSeenAtRestCountsOnceTheSensorMoves) {
  RepetitionTest test(8);
  for (int k = 0; k < 18; ++k) EXPECT_FALSE(test.update(noise_(random_), true, 1e-5));
  for (int k = 1; k <= 10; ++k) EXPECT_FALSE(test.update(0.34 * k + noise_(random_), false, 1e-5, 5.0)) << "under way";
  test.update(3.7, false, 1e-5, 5.0);
  int needed = 1;
  while (!test.update(3.7, false, 1e-5, 5.0) && needed < 100) ++needed;
  EXPECT_GE(needed, 8);
  EXPECT_LE(needed, 12) << "a quarter of a second";
}

TEST_F(Repetition, ACoarseSensorRepeatsHoweverItMovedBefore) {
  for (double quantum : {0.0065, 0.0131, 0.06, 0.1}) {
    for (double deviation : {0.0, 0.003}) {
      SCOPED_TRACE(std::to_string(quantum) + ", noise " + std::to_string(deviation));
      RepetitionTest test(8);
      const auto feed = [&](double speed, bool rest, double explained) {
        const double value = speed + deviation / 0.03 * noise_(random_);
        return test.update(quantum * std::round(value / quantum), rest, 1e-5, explained);
      };
      for (int round = 0; round < 20; ++round) {
        for (int k = 0; k < 50; ++k) EXPECT_FALSE(feed(0.0, true, 0.0));
        for (int k = 1; k <= 30; ++k) EXPECT_FALSE(feed(0.34 * k, false, 0.34));
        for (int k = 0; k < 200; ++k) ASSERT_FALSE(feed(10.2 + 0.001 * k, false, 0.001));
      }
    }
  }
}

TEST_F(Repetition, ChangesThatAreExplainedTeachNothing) {
  RepetitionTest test(8);
  for (int k = 0; k < 1000; ++k) test.update(noise_(random_), true, 1e-5, RepetitionTest::kAnyChange);
  for (int k = 0; k < 1000; ++k) ASSERT_FALSE(test.update(5.0, false, 1e-5));
}

TEST_F(Repetition, ARunThatCondemnsTeaches) {
  RepetitionTest test(8);
  feedNoise(test, 200, 0.0);
  const auto repeatsUntilSuspect = [&] {
    int count = 0;
    test.update(5.0 + noise_(random_), false, 1e-5);
    for (test.update(7.0, false, 1e-5); !test.update(7.0, false, 1e-5) && count < 100;) ++count;
    for (int k = 0; k < 20; ++k) test.update(7.0, false, 1e-5);
    return count;
  };
  const int first = repeatsUntilSuspect();
  EXPECT_LT(first, repeatsUntilSuspect());
}

/// A channel with a known number of noisy samples, of repetitions, resolution and change by noise.
class KnownChannel {
 public:
  /// @param quantum q, shown by motion, which is no noise; @param change c of every noisy sample.
  KnownChannel(double quantum, double change) : change_(change) {
    test.update(0.0, false, 1e-5);
    test.update(-quantum, false, 1e-5, RepetitionTest::kAnyChange);
    value_ = -quantum;
  }

  /// Shows noise, to and fro, an even number of samples. @param repeated each value twice.
  void show(int noisy, bool repeated = false) {
    for (int k = 0; k < noisy; ++k) {
      value_ += k % 2 == 0 ? change_ : -change_;
      test.update(value_, false, 1e-5);
      if (repeated) test.update(value_, false, 1e-5);
    }
  }

  /// Repetitions of the next value until the run is suspect; 1000 if it never is. The value itself is one of motion.
  int repetitionsUntilSuspect() {
    value_ += 2.0 * change_;
    test.update(value_, false, 1e-5, RepetitionTest::kAnyChange);
    for (int count = 1; count < 1000; ++count) {
      if (test.update(value_, false, 1e-5)) return count;
    }
    return 1000;
  }

  RepetitionTest test{1};

 private:
  double change_;
  double value_ = 0.0;
};

/// The same by the formula: (m + k p) / (n + m + k) for another repetition, below a billionth for all of them.
int expectedRepetitions(double noisy, double repeats, double quantum, double change) {
  double chance = 1.0;
  int run = 0;
  for (; chance >= 1e-9; ++run) {
    const double m = repeats + run;
    chance *= (m + 50.0 * quantum / (2.0 * change)) / (noisy + m + 50.0);
  }
  return run;
}

TEST_F(Repetition, ARunIsSuspectOnceItIsLessLikelyThanOneInABillion) {
  struct Channel {
    int plain, repeated;  // noisy samples
    double quantum, change;
  };
  for (const Channel& c : {Channel{30, 0, 0.01, 0.03}, Channel{200, 0, 0.01, 0.03}, Channel{30, 0, 0.001, 0.03},
                           Channel{100, 40, 0.01, 0.03}, Channel{40, 100, 0.01, 0.2}, Channel{10, 200, 0.5, 1.5},
                           Channel{600, 60, 2.0, 8.0}, Channel{30, 10, 0.1, 0.16}}) {
    KnownChannel channel(c.quantum, c.change);
    channel.show(c.plain);
    channel.show(c.repeated, true);
    EXPECT_EQ(channel.repetitionsUntilSuspect(),
              expectedRepetitions(c.plain + c.repeated, c.repeated, c.quantum, c.change))
        << c.plain << ", " << c.repeated << ", " << c.quantum << ", " << c.change;
  }
}

TEST_F(Repetition, WhatIsKnownOfAChannelFadesWithinAMinute) {
  KnownChannel channel(0.01, 0.03);
  channel.show(2000);
  channel.show(1000, true);  // of the first 3000, which are 2500 and 500, a half is left
  EXPECT_EQ(channel.repetitionsUntilSuspect(), expectedRepetitions(1750.0, 750.0, 0.01, 0.03));
}

TEST_F(Repetition, FiveSamplesOfNoiseAreEnoughIfItIsTwiceTheResolution) {
  const auto isFound = [](int noisy, double ratio) {
    KnownChannel channel(0.01, 0.01 * ratio);
    channel.show(noisy);
    return channel.repetitionsUntilSuspect() < 1000;
  };
  EXPECT_FALSE(isFound(4, 3.0));
  EXPECT_TRUE(isFound(6, 3.0));
  EXPECT_TRUE(isFound(6, 2.2));
  EXPECT_FALSE(isFound(6, 1.8));
  EXPECT_FALSE(isFound(22, 1.8));
  EXPECT_TRUE(isFound(28, 1.8)) << "of many, three halves are enough";
  EXPECT_FALSE(isFound(28, 1.4));
}

TEST_F(Repetition, OnlyWhatComesBackIsNoise) {
  constexpr double kAnyChange = RepetitionTest::kAnyChange;
  // Falls, shows its resolution, and comes back some times; @returns whether these are enough noise.
  const auto isFound = [](int falls, bool fall_counts, int comes_back) {
    RepetitionTest test(1);
    double value = 0.0;
    const auto change = [&](double by, double explained = 0.0) {
      return test.update(value += by, false, 1e-5, explained);
    };
    change(0.0);
    if (fall_counts) change(-0.001, kAnyChange);
    for (int k = 0; k < falls; ++k) change(-0.03);
    if (!fall_counts) change(-0.001, kAnyChange);
    for (int k = 0; k < comes_back; ++k) change(k % 2 == 0 ? 0.03 : -0.03);
    bool suspect = false;
    for (int k = 0; k < 200; ++k) suspect |= change(0.0);
    return suspect;
  };
  for (const int falls : {1, 2, 5}) {
    EXPECT_FALSE(isFound(falls, false, 4)) << falls;
    EXPECT_TRUE(isFound(falls, false, 5)) << falls;
    EXPECT_FALSE(isFound(falls, true, 3)) << falls << ": with the last one four";
    EXPECT_TRUE(isFound(falls, true, 4)) << falls << ": with the last one five";
  }
}

TEST_F(Repetition, ASourceThatRepeatsMoreThanTwiceAsOftenAsItChangesIsNotCondemned) {
  const auto isFound = [](int noisy, int repetitions) {
    KnownChannel channel(0.001, 0.03);
    channel.show(noisy);
    for (; repetitions > 0; repetitions -= 10) {
      channel.test.update(10.0 * repetitions, false, 1e-5, RepetitionTest::kAnyChange);
      for (int k = 0; k < 10; ++k) channel.test.update(10.0 * repetitions, false, 1e-5);
    }
    return channel.repetitionsUntilSuspect() < 1000;
  };
  EXPECT_TRUE(isFound(30, 50));
  EXPECT_FALSE(isFound(30, 70));
}

TEST_F(Repetition, TheResolutionIsKnownAfterTenChanges) {
  RepetitionTest test(8);
  test.update(0.0, false, 1e-5);
  for (int k = 1; k < 10; ++k) test.update(0.03 * (k % 2), false, 1e-5);
  EXPECT_EQ(test.quantum(), 0.0);
  test.update(0.0, false, 1e-5);
  EXPECT_EQ(test.quantum(), 0.03);
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

TEST_F(Repetition, WithoutNoiseASteadyValueIsNormal) {
  RepetitionTest test(8);
  double value = 0.0;
  for (int k = 0; k < 2000; ++k) {
    value += 0.2 * (5.0 - value);  // ends in 5 to the bit
    EXPECT_FALSE(test.update(value, false, 1e-5)) << k;
  }
  EXPECT_EQ(value, value + 0.2 * (5.0 - value));
}

TEST_F(Repetition, ExpectedRepetitionsSayNothing) {
  RepetitionTest test(8);
  EXPECT_FALSE(feedNoise(test, 100, 0.0));
  for (int k = 0; k < 100; ++k) EXPECT_FALSE(test.update(0.0, true, 1e-5));
}

/// A robot that creeps, whose encoder repeats now and then: as often as that it repeats when it goes on faster.
TEST_F(Repetition, ASlowWheelTeachesHowOftenItsEncoderRepeats) {
  const auto suspects = [](bool crept) {
    RepetitionTest test(3);
    std::mt19937 random(1);
    double value = 0.3;
    for (int k = 0; k < 400; ++k) {
      if (!crept || k % 5 == 0) value = 0.3 + 0.01 * static_cast<double>(random() % 16);
      test.update(value, true, 1e-5);
    }
    bool suspect = false;
    for (int k = 0; k < 12; ++k) suspect = test.update(0.6, false, 1e-5) || suspect;
    return suspect;
  };
  EXPECT_TRUE(suspects(false));
  EXPECT_FALSE(suspects(true));
}

TEST_F(Repetition, CanBeSwitchedOff) {
  RepetitionTest test(0);
  EXPECT_FALSE(feedNoise(test, 100, 0.0));
  for (int k = 0; k < 100; ++k) EXPECT_FALSE(test.update(1.0, false, 1e-5));
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
