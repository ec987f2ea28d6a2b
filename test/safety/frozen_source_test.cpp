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

/// Feeds a source for a while; returns the time after its last sample.
double feed(FrozenSource& source, double from, double duration, double value, double change, bool may_repeat = false) {
  const long samples = std::lround(duration / kPeriod);
  for (long i = 0; i < samples; ++i) source.update(from + i * kPeriod, sample(value + change * i), may_repeat);
  return from + samples * kPeriod;
}

TEST(FrozenSource, OneThatChangesIsAlive) {
  FrozenSource source(0.3);
  feed(source, 0.0, 5.0, 1.0, 1e-12);
  EXPECT_FALSE(source.frozen());
}

TEST(FrozenSource, OneThatRepeatsForLongerThanAllowedIsFrozen) {
  FrozenSource source(0.3);
  const double frozen_from = feed(source, 0.0, 1.0, 1.0, 0.1) - kPeriod;
  const FrozenSource::Sample last = sample(1.0 + 0.1 * 49);
  source.update(frozen_from + 0.29, last, false);
  EXPECT_FALSE(source.frozen());
  source.update(frozen_from + 0.32, last, false);
  EXPECT_TRUE(source.frozen());
}

TEST(FrozenSource, AChangeThawsIt) {
  FrozenSource source(0.3);
  const double end = feed(source, 0.0, 1.0, 1.0, 0.0);
  ASSERT_TRUE(source.frozen());
  source.update(end, sample(2.0), false);
  EXPECT_FALSE(source.frozen());
}

TEST(FrozenSource, RepetitionAtRestIsNotCounted) {
  FrozenSource source(0.3);
  const double move = feed(source, 0.0, 10.0, 0.0, 0.0, true);
  EXPECT_FALSE(source.frozen());
  const double late = feed(source, move, 0.3, 0.0, 0.0);
  EXPECT_FALSE(source.frozen()) << "counts from the beginning of the motion on";
  feed(source, late, 0.1, 0.0, 0.0);
  EXPECT_TRUE(source.frozen());
}

TEST(FrozenSource, ZeroSwitchesItOff) {
  FrozenSource source(0.0);
  feed(source, 0.0, 10.0, 1.0, 0.0);
  EXPECT_FALSE(source.frozen());
}

TEST(FrozenSource, ResetForgets) {
  FrozenSource source(0.3);
  feed(source, 10.0, 1.0, 1.0, 0.0);
  source.reset();
  EXPECT_FALSE(source.frozen());
  source.update(0.0, sample(1.0), false);
  EXPECT_FALSE(source.frozen());
}

}  // namespace
}  // namespace jackal_aic
