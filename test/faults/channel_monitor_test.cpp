#include "jackal_aic/faults/channel_monitor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <utility>

namespace jackal_aic {
namespace {

constexpr double kStep = 0.02;

// ---- verdicts

std::string times(int number, const std::string& samples) {
  std::string all;
  for (; number > 0; --number) all += samples;
  return all;
}

/// What a channel says to samples. @param samples s: suspect, g: good, q: good, but a fault would not show.
/// @returns x: outlier, F: faulty, o: ok.
std::string verdicts(Persistence& channel, const std::string& samples) {
  std::string said;
  for (const char sample : samples) {
    const ChannelState state = channel.update(sample == 's', sample != 'q', kStep);
    EXPECT_EQ(channel.state(), state);
    said += state == ChannelState::faulty ? 'F' : state == ChannelState::outlier ? 'x' : 'o';
  }
  return said;
}

TEST(Persistence, EnoughOutliersInTheWindowAreAFault) {
  Persistence channel(1.0);
  EXPECT_EQ(verdicts(channel, times(500, "sg")), times(500, "xo")) << "4 of 8";
  EXPECT_EQ(verdicts(channel, "gggggggg"), "oooooooo");
  EXPECT_EQ(verdicts(channel, "ssgsgss"), "xxoxoxF");
  channel.reset();
  EXPECT_EQ(verdicts(channel, "ssss"), "xxxx");
  EXPECT_TRUE(channel.suspecting());
  channel.reset();
  EXPECT_FALSE(channel.suspecting());
  EXPECT_EQ(verdicts(channel, "s"), "x") << "one of one";
}

TEST(Persistence, RecoversAfterASecondOfGoodSamplesThatSaySomething) {
  Persistence channel(1.0);
  EXPECT_EQ(verdicts(channel, "sssss"), "xxxxF");
  EXPECT_EQ(verdicts(channel, times(200, "q")), times(200, "F"));
  EXPECT_EQ(verdicts(channel, times(40, "g")), times(40, "F"));
  EXPECT_EQ(verdicts(channel, "s"), "F") << "a relapse";
  EXPECT_EQ(verdicts(channel, times(48, "g")), times(48, "F"));
  verdicts(channel, "ggg");
  EXPECT_EQ(verdicts(channel, "gs"), "ox") << "the window starts empty";
  for (const int left : {0, 40}) {  // of a second that began before it was declared again
    verdicts(channel, times(60, "g"));
    if (left > 0) channel.declareFaulty();
    EXPECT_EQ(verdicts(channel, times(left, "g")), times(left, "F"));
    channel.declareFaulty();
    EXPECT_EQ(verdicts(channel, times(40, "g")), times(40, "F"));
    EXPECT_EQ(verdicts(channel, times(11, "g")).back(), 'o');
  }
}

// ---- missed motion

/// Shows a value that repeats to a prediction that stays. @returns the samples until motion is missed, 1000 if never.
int samplesUntilMissed(MissedMotion& test, double value, double low, double high, double hold = 0.0) {
  for (int k = 0; k < 1000; ++k) {
    if (test.update(value, true, low, high, 0.3, kStep, hold)) return k;
  }
  return 1000;
}

TEST(MissedMotion, IsFoundWhereTheRangesAreApartAndTheValueWasNotThereBefore) {
  const struct {
    const char* why;
    double value, low, high;  // as it was renewed
    double low_now, high_now;
    bool missed;
  } rows[] = {
      {"it moved up", 5.0, 4.9, 5.1, 5.9, 6.1, true},       {"it moved down", 5.0, 4.9, 5.1, 2.9, 3.1, true},
      {"nothing to miss", 5.0, 4.9, 5.1, 4.9, 5.1, false},  {"was there before", 6.0, 4.0, 5.0, 5.9, 6.1, false},
      {"was there before", 3.0, 4.9, 5.1, 2.9, 3.1, false}, {"may be where it was", 4.5, 4.0, 5.0, 4.9, 9.0, false}};
  for (const auto& row : rows) {
    for (const double sign : {1.0, -1.0}) {
      const auto mirrored = [sign](double a, double b) { return sign > 0.0 ? std::pair(a, b) : std::pair(-b, -a); };
      const auto [low, high] = mirrored(row.low, row.high);
      const auto [low_now, high_now] = mirrored(row.low_now, row.high_now);
      MissedMotion test;
      EXPECT_FALSE(test.update(sign * row.value, false, low, high, 0.3, kStep));
      const int samples = samplesUntilMissed(test, sign * row.value, low_now, high_now);
      EXPECT_EQ(samples < 1000, row.missed) << row.why << ", " << sign;
      EXPECT_TRUE(!row.missed || samples * kStep <= 0.26) << row.why;
      EXPECT_FALSE(test.update(6.1, false, 6.0, 6.2, 0.3, kStep)) << "it lives again";
    }
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

TEST(MissedMotion, IsGivenTwiceTheLongestTimeThatItTookBefore) {
  // A source that is renewed now and then misses motion in between.
  const struct {
    const char* why;
    int renewals, samples;  // from one renewal to the next
    double patience;        // s
  } rows[] = {{"hardly known: the longest patience", 3, 1, 0.26},
              {"known to be renewed all the time", 30, 1, 0.12},
              {"renewed at 10 Hz, misses 0.08 s", 30, 5, 0.18},
              {"renewed at 5 Hz: the longest patience", 30, 10, 0.26}};
  for (const auto& row : rows) {
    MissedMotion test;
    double at = 0.0;
    for (int k = 0; k <= row.renewals; ++k, at += 1.0) {
      EXPECT_FALSE(test.update(at, false, at, at, 0.3, kStep));
      for (int i = 1; i < row.samples && k < row.renewals; ++i) {
        EXPECT_FALSE(test.update(at, true, at + 1.0, at + 1.0, 0.3, kStep)) << row.why;
      }
    }
    EXPECT_NEAR((samplesUntilMissed(test, at - 1.0, at, at) + 1) * kStep, row.patience, 0.021) << row.why;
  }
}

TEST(MissedMotion, ASourceThatWasRenewedSeldomWhileItCreptIsWaitedForWhenItDrivesOff) {
  constexpr double kPublished = 0.05;  // s
  constexpr int kHeldSamples = 5;      // renewed at 4 Hz
  MissedMotion test;
  double measured = 0.0;
  for (int k = 0; k < 300; ++k) {
    const double speed = k < 200 ? 0.6 + 0.02 * (k / kHeldSamples % 2) : 0.6 + 0.2 * (k - 200);
    const bool renewed = k % kHeldSamples == 0;
    if (renewed) measured = speed;
    EXPECT_FALSE(test.update(measured, !renewed, speed, speed, 0.3, kPublished)) << k;
  }
}

TEST(MissedMotion, WaitsForAnEncoderThatHoldsItsValue) {
  for (const double hold : {0.0, 0.2}) {
    MissedMotion motion;
    for (int i = 0; i < 20; ++i) motion.update(0.01 * i, false, 0.01 * i, 0.01 * i, 0.1, kStep);
    const double after = kStep * (samplesUntilMissed(motion, 0.19, 5.0, 5.0, hold) + 1);
    EXPECT_LT(after, hold > 0.0 ? 0.6 : 0.2);
    EXPECT_GT(after, hold > 0.0 ? 0.4 : 0.0);
  }
}

// ---- encoders that hold their value

TEST(SampleHold, LearnsForHowLongAnEncoderHoldsItsValue) {
  const struct {
    const char* why;
    std::function<double(int)> value;
    int samples;
    double period, longest;  // s
  } rows[] = {
      {"renewed at 4 Hz, published at 20", [](int i) { return 0.2 * (i / 5); }, 100, 0.05, 0.2},
      {"two renewals: the longest so far", [](int i) { return 1.0 * (i / 5); }, 12, 0.05, 0.2},
      {"every sample is a new one", [](int i) { return 0.2 * i; }, 100, 0.05, 0.0},
      {"what lasts that long is no renewal", [](int i) { return 2.0 * (i / 20); }, 100, 0.05, 0.0},
      {"stands between two motions", [](int i) { return i % 20 < 10 ? 1.0 : 2.0; }, 200, 0.02, 0.0},
      {"stands, shivers, goes up", [](int i) { return 0.05 * (i / 10 + 1) + 1.0 * ((i + 5) / 10); }, 100, 0.02, 0.0}};
  for (const auto& row : rows) {
    SampleHold hold;
    for (int i = 0; i < row.samples; ++i) hold.update(row.value(i), 0.1, row.period);
    EXPECT_NEAR(hold.longest(), row.longest, 1e-9) << row.why;
  }
}

}  // namespace
}  // namespace jackal_aic
