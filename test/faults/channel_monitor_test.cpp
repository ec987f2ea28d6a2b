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

TEST(ChebyshevBound, HoldsForAnyDistribution) {
  // Two-valued errors that reach the bound exactly: +-d with probability alpha/2 each, else 0, have variance alpha d^2
  // = 1.
  for (double alpha : {0.01, 0.04, 0.2}) EXPECT_DOUBLE_EQ(alpha * std::pow(chebyshevBound(1, alpha), 2), 1.0);
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
  Persistence channel({5, 8, 1.0}), largest({64, 64, 1.0});
  EXPECT_EQ(verdicts(channel, times(500, "sg")), times(500, "xo")) << "4 of 8";
  EXPECT_EQ(verdicts(channel, "gggggggg"), "oooooooo");
  EXPECT_EQ(verdicts(channel, "ssgsgss"), "xxoxoxF");
  EXPECT_EQ(verdicts(largest, times(64, "s")), times(63, "x") + "F");
  channel.reset();
  EXPECT_EQ(verdicts(channel, "ssss"), "xxxx");
  EXPECT_TRUE(channel.suspecting());
  channel.reset();
  EXPECT_FALSE(channel.suspecting());
  EXPECT_EQ(verdicts(channel, "s"), "x") << "one of one";
}

TEST(Persistence, RecoversAfterASecondOfGoodSamplesThatSaySomething) {
  Persistence channel({2, 2, 1.0});
  EXPECT_EQ(verdicts(channel, "ss"), "xF");
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
