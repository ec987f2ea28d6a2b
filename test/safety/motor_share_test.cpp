#include "jackal_aic/safety/motor_share.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;  // s

TEST(MotorShare, OffersAroundAnothersCommandDoNotMakeItOurs) {
  MotorShare share;
  for (int i = 0; i < 150; ++i) {
    const double time = kPeriod * i, wish = i % 2 == 0 ? 8.0 : -8.0;
    share.apply(time, {2.0, 2.0}, AppliedSource::drive);
    share.send(time, share.ours(time) ? WheelCommand{5.0, 5.0} : share.offer({wish, wish}));
    if (i > 50) {
      ASSERT_FALSE(share.ours(time)) << i;
    }
  }
}

TEST(MotorShare, ToleranceIsThreeTenthsPlusATwentieth) {
  for (const auto& [applied, ours] :
       {std::pair(WheelCommand{0.31, -0.31}, true), std::pair(WheelCommand{0.32, 0.0}, false)}) {
    MotorShare share;  // 0.3 + 0.05 x 0.31 is 0.3155
    for (int i = 0; i < 50; ++i) {
      share.send(kPeriod * i, {});
      share.apply(kPeriod * i, applied, AppliedSource::drive);
    }
    EXPECT_EQ(share.ours(1.0), ours);
  }
}

/// Whether commands that approach ours by so much every 0.18 s are ours.
bool isApproach(double step) {
  MotorShare share;
  share.send(0.0, {10.0, 10.0});
  share.apply(0.0, {10.0, 10.0}, AppliedSource::drive);
  double wheels = 0.0, time = kPeriod;
  for (int i = 0; i < 20; ++i, wheels += step) {
    for (int k = 0; k < 9; ++k, time += kPeriod) {
      share.send(time, {10.0, 10.0});
      share.apply(time, {wheels, wheels}, AppliedSource::drive);
      if (!share.ours(time)) return false;
    }
  }
  return true;
}

TEST(MotorShare, NeedsTwoTenthsWithinThePatience) {
  EXPECT_TRUE(isApproach(0.24));
  EXPECT_FALSE(isApproach(0.15));
}

TEST(MotorShare, CoversTheSameTimeAtAnyRate) {
  for (const int rate : {50, 500, 1000}) {
    MotorShare share;
    const int late = rate / 5;  // of a ramp through a transport of 0.2 s
    for (int k = 0; k < 2 * rate; ++k) {
      const double time = 1.0 * k / rate, then = std::max(0.0, time - 1.0 * late / rate);
      share.send(time, {8.0 * time, 8.0 * time});
      share.apply(time, {8.0 * then, 8.0 * then}, AppliedSource::drive);
      ASSERT_TRUE(share.ours(time)) << rate << " Hz, " << time << " s";
    }
  }
}

}  // namespace
}  // namespace jackal_aic
