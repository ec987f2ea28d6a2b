#include "jackal_aic/faults/acceleration_monitor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "jackal_aic/model/gravity.hpp"

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;  // s

/// A body that accelerates as its wheels do, and the monitor of its accelerometer.
class WatchedBody {
 public:
  /// Goes on for some samples with an acceleration [m/s^2]; returns the largest distance. @param measured of it.
  double accelerate(double rate, int samples, double measured) {
    double most = 0.0;
    for (int i = 0; i < samples; ++i) {
      for (int k = 0; k < 20; ++k) monitor.predict(rate, rate, rate, 0.001);
      Observation y;
      y.acceleration_x = measured + 0.05 * normal_(random_);
      y.acceleration_z = kGravity + 0.05 * normal_(random_);
      monitor.check(y, true, speed, kPeriod);
      most = std::max(most, monitor.distance());
    }
    return most;
  }

  AccelerationMonitor monitor{FaultParameters{}};
  double speed = 0.0;  // of the wheels [m/s]

 private:
  std::mt19937 random_{5};
  std::normal_distribution<double> normal_{0.0, 1.0};
};

TEST(AccelerationMonitor, AnAccelerationOfTheWheelsIsExpectedOfTheBody) {
  WatchedBody follows, opposes;
  follows.accelerate(0.0, 150, 0.0);
  opposes.accelerate(0.0, 150, 0.0);
  const double expected = follows.accelerate(1.6, 15, 1.6);
  const double unexpected = opposes.accelerate(1.6, 15, -1.6);
  EXPECT_LT(expected, 1.0);
  EXPECT_GT(unexpected, 1.5 * expected);
  EXPECT_LT(follows.accelerate(-1.6, 15, -1.6), 1.0);
}

TEST(AccelerationMonitor, WhatWasPossibleFadesWithinTenthsOfASecond) {
  // A body that follows its wheels late still accelerates when they have ceased to; long after they have, it does not.
  WatchedBody late, much_later;
  for (WatchedBody* body : {&late, &much_later}) {
    body->accelerate(0.0, 150, 0.0);
    body->accelerate(1.6, 15, 1.6);
  }
  const double at_once = late.accelerate(0.0, 2, 1.6);
  much_later.accelerate(0.0, 50, 0.0);
  const double afterwards = much_later.accelerate(0.0, 2, 1.6);
  EXPECT_GT(afterwards, 2.0 * at_once);
}

TEST(AccelerationMonitor, CollisionCountsButNothingThatTakesMoreThanTheSpeedOrLastsLonger) {
  WatchedBody hits, jumps, speeds_up, stays;
  for (WatchedBody* body : {&hits, &jumps, &speeds_up, &stays}) {
    body->speed = 1.0;
    body->accelerate(0.0, 150, 0.0);
  }
  EXPECT_GT(hits.accelerate(0.0, 2, -24.0), 1.0);
  EXPECT_EQ(hits.monitor.state(), ChannelState::ok) << "0.96 m/s in 0.04 s";
  jumps.accelerate(0.0, 1, -80.0);
  EXPECT_EQ(jumps.monitor.state(), ChannelState::outlier) << "1.6 m/s";
  speeds_up.accelerate(0.0, 2, 24.0);
  EXPECT_EQ(speeds_up.monitor.state(), ChannelState::outlier);
  stays.accelerate(0.0, 8, -8.0);
  EXPECT_EQ(stays.monitor.state(), ChannelState::faulty) << "a collision is over sooner";
}

TEST(AccelerationMonitor, WhatFollowsACollisionIsOfABodyThatBounces) {
  WatchedBody bounces;
  bounces.speed = 1.0;
  bounces.accelerate(0.0, 150, 0.0);
  bounces.accelerate(0.0, 1, -48.0);
  EXPECT_GT(bounces.accelerate(0.0, 10, 6.0), 1.0);
  EXPECT_EQ(bounces.monitor.state(), ChannelState::ok) << "tyres that slide, for 0.2 s";
  bounces.accelerate(0.0, 12, 6.0);
  EXPECT_EQ(bounces.monitor.state(), ChannelState::faulty) << "no bounce takes so long";
}

TEST(AccelerationMonitor, IsFaultyWithTheSampleThatShowsItFrozen) {
  WatchedBody body;
  body.accelerate(0.0, 150, 0.0);
  Observation y;
  y.acceleration_x = 0.01;
  y.acceleration_z = kGravity;
  int samples = 0;
  for (; samples < 100 && !body.monitor.frozen(); ++samples) {
    for (int k = 0; k < 20; ++k) body.monitor.predict(0.0, 0.0, 0.0, 0.001);
    body.monitor.check(y, true, body.speed, kPeriod);
  }
  EXPECT_TRUE(body.monitor.frozen());
  EXPECT_LT(samples, 15);
  EXPECT_EQ(body.monitor.state(), ChannelState::faulty);
}

}  // namespace
}  // namespace jackal_aic
