#include "jackal_aic/safety/frozen_source.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;  // s

FrozenSource::Sample sample(double value) {
  FrozenSource::Sample s = FrozenSource::Sample::Zero();
  s(3) = value;
  return s;
}

/// Feeds a source for a time [s], with a value that changes by so much in a sample; returns the time after it.
double feed(FrozenSource& source, double from, double duration, double change = 0.0, bool may_repeat = false) {
  const long samples = std::lround(duration / kPeriod);
  for (long i = 0; i < samples; ++i) source.update(from + i * kPeriod, sample(1.0 + change * i), may_repeat);
  return from + samples * kPeriod;
}

TEST(FrozenSource, IsFrozenAfterItsTimeAndUntilItChanges) {
  FrozenSource source(0.3);
  feed(source, -5.0, 4.0, 1e-12);
  EXPECT_FALSE(source.frozen());
  const double since = feed(source, 0.0, 1.0, 0.1) - kPeriod;
  const FrozenSource::Sample last = sample(1.0 + 0.1 * 49);
  source.update(since + 0.29, last, false);
  EXPECT_FALSE(source.frozen());
  source.update(since + 0.32, last, false);
  EXPECT_TRUE(source.frozen());
  source.update(since + 0.34, sample(2.0), false);
  EXPECT_FALSE(source.frozen());
}

TEST(FrozenSource, TimeAtRestDoesNotCount) {
  FrozenSource source(0.3);
  const double move = feed(source, 0.0, 10.0, 0.0, true);
  EXPECT_FALSE(source.frozen());
  const double late = feed(source, move, 0.3);
  EXPECT_FALSE(source.frozen()) << "counts from the beginning of the motion on";
  feed(source, late, 0.1);
  EXPECT_TRUE(source.frozen());
}

TEST(FrozenSource, ZeroDisablesItAndResetForgets) {
  FrozenSource disabled(0.0), source(0.3);
  feed(disabled, 0.0, 10.0);
  EXPECT_FALSE(disabled.frozen());
  feed(source, 10.0, 1.0);
  source.reset();
  EXPECT_FALSE(source.frozen());
  source.update(0.0, sample(1.0), false);
  EXPECT_FALSE(source.frozen());
}

}  // namespace
}  // namespace jackal_aic
