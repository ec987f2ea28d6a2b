#include "jackal_aic/faults/acceleration_monitor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "jackal_aic/model/gravity.hpp"

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;  // s
const SampleStep kStep(kPeriod, FaultParameters{}.covariance_time_constant);

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
      monitor.check(y, true, speed, kStep);
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

/// However often an accelerometer is read.
TEST(AccelerationMonitor, WhatTheGroundDoesIsNoFaultAndAWrongReadingIsOneSoon) {
  for (const int rate : {20, 50, 100, 200}) {
    const double period = 1.0 / rate;
    // @returns for how long it is faulty within a second in which it reads this [s]
    const auto faulty = [period](double acceleration, double duration) {
      AccelerationMonitor monitor{FaultParameters{}};
      std::mt19937 random(5);
      std::normal_distribution<double> noise(0.0, 0.05);
      double found = 0.0;
      for (int k = 0; k < std::lround(5.0 / period); ++k) {
        const double time = k * period - 4.0;
        for (int i = 0; i < std::lround(period / 0.001); ++i) monitor.predict(0.0, 0.0, 0.0, 0.001);
        Observation y;
        y.acceleration_x = (time > 0.0 && time < duration + 1e-9 ? acceleration : 0.0) + noise(random);
        y.acceleration_z = kGravity + noise(random);
        monitor.check(y, true, 1.5, {period, FaultParameters{}.covariance_time_constant});
        if (monitor.state() == ChannelState::faulty) found += period;
      }
      return found;
    };
    EXPECT_EQ(faulty(-25.0, 0.05), 0.0) << rate << " Hz, collision";
    EXPECT_EQ(faulty(12.0, 0.06), 0.0) << rate << " Hz, push";
    EXPECT_EQ(faulty(3.0, 0.08), 0.0) << rate << " Hz, sill";
    EXPECT_GT(faulty(12.0, 1.0), 0.7) << rate << " Hz, wrong";
  }
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
    body.monitor.check(y, true, body.speed, kStep);
  }
  EXPECT_TRUE(body.monitor.frozen());
  EXPECT_LT(samples, 15);
  EXPECT_EQ(body.monitor.state(), ChannelState::faulty);
}

/// A body without noise: every distance is known from the formulas of the header.
class QuietBody {
 public:
  /// @param vertical its accelerometer has a vertical axis; @param moving its wheels turn.
  explicit QuietBody(bool vertical = false, bool moving = false) : vertical_(vertical), moving_(moving) {}

  /// Goes on for some samples; returns the distance of the last one. @param x, z measured [m/s^2].
  double measure(int samples, double x, double z = kGravity) {
    for (int i = 0; i < samples; ++i) {
      pass(kPeriod);
      Observation y;
      y.acceleration_x = x;
      if (vertical_) y.acceleration_z = z;
      monitor.check(y, moving_, speed, kStep);
    }
    return monitor.distance();
  }

  /// Lets time pass [s].
  void pass(double duration) {
    for (long k = std::lround(duration / 0.001); k > 0; --k) monitor.predict(rate, lowest, highest, 0.001);
  }

  /// The state after some samples that are good otherwise.
  ChannelState hit(int samples, double x) {
    measure(samples, x);
    return monitor.state();
  }

  AccelerationMonitor monitor{FaultParameters{}};
  double rate = 0.0, lowest = 0.0, highest = 0.0;  // of the wheels [m/s^2]
  double speed = 0.0;                              // of the wheels [m/s]

 private:
  bool vertical_, moving_;
};

constexpr double kBound = 5.0;               // sqrt(1 / 0.04)
constexpr double kSensor = 2.5e-3;           // variance of the sensor [(m/s^2)^2]
constexpr double kUnknown = 1.0 + kSensor;   // of an acceleration on unknown ground
constexpr double kKnown = 0.0222 + kSensor;  // ... on ground that has been seen for long
constexpr double kUnknownNoise = 5.0;        // factor of the deviation while the noise is unknown

TEST(AccelerationMonitor, AtTheStartTheGroundMayBeInclined) {
  QuietBody body;
  EXPECT_NEAR(body.measure(1, 2.0), 2.0 / (kUnknownNoise * std::sqrt(kUnknown) * kBound), 1e-6);
}

TEST(AccelerationMonitor, WhileNothingIsSeenTheInclinationWanders) {
  QuietBody body;
  body.measure(500, 0.0);
  body.pass(0.23);
  EXPECT_NEAR(body.measure(1, 1.0), 1.0 / (std::sqrt(0.0022 + 0.25 + kSensor) * kBound), 0.01);
  QuietBody steady;
  steady.measure(500, 0.0);
  EXPECT_NEAR(steady.measure(1, 0.1), 0.1 / (std::sqrt(kKnown) * kBound), 0.002);
}

TEST(AccelerationMonitor, AnInclinationIsLearnedUpToTheSteepestThatARobotStandsOn) {
  for (const double sign : {1.0, -1.0}) {
    EXPECT_LT(QuietBody().measure(250, sign * 6.0), 0.01) << "38 degrees";
    EXPECT_GT(QuietBody().measure(250, sign * 9.0), 0.1);
    EXPECT_LT(QuietBody(true).measure(250, 0.0, kGravity + sign * 2.0), 0.01);
    EXPECT_GT(QuietBody(true).measure(250, 0.0, kGravity + sign * 5.0), 0.1);
  }
}

TEST(AccelerationMonitor, WhatTheDriveTrainMayDoIsNoError) {
  for (const double sign : {1.0, -1.0}) {
    QuietBody body;
    body.measure(250, 0.5);  // inclined
    body.rate = sign * 1.0;
    body.lowest = sign > 0.0 ? 0.5 : -2.0;
    body.highest = sign > 0.0 ? 2.0 : -0.5;
    body.measure(250, 0.5 + sign);
    const auto errorOf = [body](double x) {
      QuietBody copy = body;
      return copy.measure(1, 0.5 + x) * std::sqrt(kKnown) * kBound;
    };
    EXPECT_NEAR(errorOf(sign * 1.9), 0.0, 0.01);
    EXPECT_NEAR(errorOf(sign * 2.3), 0.3, 0.01);
    EXPECT_NEAR(errorOf(sign * 0.1), 0.0, 0.01);
    EXPECT_NEAR(errorOf(sign * -0.3), 0.3, 0.01);
  }
}

TEST(AccelerationMonitor, WhatWasPossibleFadesByATimeConstantOfATenthOfASecond) {
  for (const double sign : {1.0, -1.0}) {
    const auto errorAfter = [sign](int samples) {
      QuietBody body;
      body.measure(500, 0.0);
      (sign > 0.0 ? body.highest : body.lowest) = sign * 10.0;
      body.pass(0.001);
      body.lowest = body.highest = 0.0;
      body.measure(samples, 0.0);
      return body.measure(1, sign * 9.0) * std::sqrt(kKnown) * kBound;
    };
    EXPECT_NEAR(errorAfter(4), 9.0 - 10.0 * std::exp(-1.0), 0.2);
    EXPECT_NEAR(errorAfter(9), 9.0 - 10.0 * std::exp(-2.0), 0.2);
  }
}

TEST(AccelerationMonitor, AJustChangedRateMayComeLater) {
  const auto distanceAfter = [](double time) {
    QuietBody body;
    body.measure(500, 0.0);
    body.rate = body.lowest = body.highest = 1.6;
    body.pass(time - kPeriod);
    return body.measure(1, -2.0);  // 2 below all that is possible
  };
  EXPECT_NEAR(distanceAfter(0.021), 2.0 / (std::sqrt(kKnown + 1.6 * 1.6) * kBound), 0.05);
  EXPECT_GT(distanceAfter(0.021) * 1.5, 0.3);
  QuietBody body;
  body.measure(500, 0.0);
  body.rate = body.lowest = body.highest = 1.6;
  body.measure(100, 1.6);
  EXPECT_NEAR(body.measure(1, -2.0), 2.0 / (std::sqrt(kKnown) * kBound), 0.05) << "two seconds later it is there";
}

TEST(AccelerationMonitor, VibrationIsWhatSuccessiveErrorsDifferBy) {
  QuietBody body(false, true);
  body.measure(250, 0.0);
  for (int k = 0; k < 150; ++k) body.measure(1, k % 2 == 0 ? 0.15 : -0.15);
  // The believed inclination follows by 0.41 of every error, which is 0.189 to and fro then: D = 2 * 0.189^2. A jump
  // counts for nine times as much at most, with a memory of 0.2 s.
  const double before = 2.0 * 0.189 * 0.189, with_it = before + 8.0 * before * -std::expm1(-kPeriod / 0.2);
  EXPECT_NEAR(body.measure(1, 3.0), 3.04 / (std::sqrt(0.049 + with_it) * kBound), 0.03);
}

TEST(AccelerationMonitor, AtRestVibrationIsNoExcuse) {
  QuietBody body(false, false);
  body.measure(250, 0.0);
  for (int k = 0; k < 150; ++k) body.measure(1, k % 2 == 0 ? 0.15 : -0.15);
  EXPECT_GT(body.measure(1, 3.0), 2.3);
}

TEST(AccelerationMonitor, TheNoiseOfTheVerticalAxisIsLearned) {
  QuietBody body(true);
  body.measure(250, 0.0);
  EXPECT_NEAR(body.measure(1, 0.0, kGravity + 2.0), 2.0 / (std::sqrt(kKnown) * std::sqrt(50.0)), 0.05);
}

TEST(AccelerationMonitor, AWrongAccelerationIsNotGrownAccustomedTo) {
  QuietBody body;
  body.measure(250, 0.0);
  body.measure(500, 15.0);
  EXPECT_EQ(body.monitor.state(), ChannelState::faulty);
  EXPECT_GT(body.monitor.distance(), 2.0);
  body.measure(100, 0.0);
  EXPECT_EQ(body.monitor.state(), ChannelState::ok) << "and counts again when it is right again";
}

TEST(AccelerationMonitor, AnOffsetThatJumpsTeachesNoInclination) {
  for (const double jump : {3.0, -4.0}) {
    QuietBody body;
    body.measure(250, 0.5);
    body.measure(400, 0.5 + jump);
    EXPECT_EQ(body.monitor.state(), ChannelState::faulty) << "the ground does not tilt at once";
    QuietBody back = body, again = body;
    EXPECT_LT(back.measure(1, 0.5), 0.1) << "what was believed before has waited";
    back.measure(60, 0.5);
    EXPECT_EQ(back.monitor.state(), ChannelState::ok);
    again.monitor.restart();
    EXPECT_EQ(again.monitor.state(), ChannelState::ok);
    EXPECT_EQ(again.hit(1, 0.5 + jump), ChannelState::outlier) << "a restart makes no inclination of it";
  }
}

TEST(AccelerationMonitor, WhatAnInclinationExplainsForLongCountsAgain) {
  QuietBody tilted, to_and_fro;
  for (QuietBody* body : {&tilted, &to_and_fro}) body->measure(250, 0.0);
  tilted.measure(500, 3.0);
  EXPECT_EQ(tilted.monitor.state(), ChannelState::faulty);
  tilted.measure(100, 3.0);
  EXPECT_EQ(tilted.monitor.state(), ChannelState::ok) << "a steep ramp, after 11 s";
  EXPECT_LT(tilted.measure(1, 3.0), 0.1);
  for (int k = 0; k < 30; ++k) to_and_fro.measure(20, k % 2 == 0 ? 6.0 : -6.0);
  EXPECT_EQ(to_and_fro.monitor.state(), ChannelState::faulty) << "no ground does that";
}

TEST(AccelerationMonitor, WhoWasHandledMayStandOnOtherGround) {
  QuietBody body;
  body.measure(250, 0.0);
  body.measure(20, 3.0);
  ASSERT_EQ(body.monitor.state(), ChannelState::faulty);
  body.monitor.forgive();
  EXPECT_EQ(body.hit(100, 3.0), ChannelState::ok);
  EXPECT_LT(body.measure(1, 3.0), 0.1);
}

TEST(AccelerationMonitor, CollisionsThatFollowEachOtherWithinHalfASecondAreOne) {
  const auto afterHits = [](int hits, double apart) {
    QuietBody body(false, true);
    body.speed = 1.0;
    body.measure(250, 0.0);
    for (int k = 1; k < hits; ++k) {
      body.measure(2, -24.0);  // 0.96 m/s
      body.measure(static_cast<int>(std::lround(apart / kPeriod)) - 2, 0.0);
    }
    return body.hit(1, -24.0);
  };
  EXPECT_EQ(afterHits(1, 0.0), ChannelState::ok);
  EXPECT_EQ(afterHits(2, 0.4), ChannelState::outlier) << "takes more than the speed";
  EXPECT_EQ(afterHits(2, 0.7), ChannelState::ok);
  EXPECT_EQ(afterHits(3, 0.34), ChannelState::outlier) << "0.68 s since the first, 0.34 s since the last";
}

TEST(AccelerationMonitor, ACollisionTakesUpToAThirdMoreThanTheSpeed) {
  const auto afterTaking = [](double part, double speed) {
    QuietBody body(false, true);
    body.speed = speed;
    body.measure(250, 0.0);
    return body.hit(1, -part * speed / kPeriod);
  };
  for (const double speed : {0.3, 1.0, 2.0, -2.0}) {
    EXPECT_EQ(afterTaking(1.2, speed), ChannelState::ok) << speed;
    EXPECT_EQ(afterTaking(1.4, speed), ChannelState::outlier) << speed;
    EXPECT_EQ(afterTaking(-0.9, speed), ChannelState::outlier) << speed << ": faster";
  }
}

TEST(AccelerationMonitor, OnlyWhatTakesHalfOfTheSpeedHasAnAftermath) {
  const auto aftermath = [](double taken, double speed, double acceleration) {
    QuietBody body(false, true);
    body.speed = speed;
    body.measure(250, 0.0);
    EXPECT_EQ(body.hit(1, -taken / kPeriod), ChannelState::ok);
    return body.hit(4, acceleration);
  };
  EXPECT_EQ(aftermath(1.2, 2.0, 9.0), ChannelState::ok) << "tyres slide by less than gravity";
  EXPECT_EQ(aftermath(1.2, 2.0, 12.0), ChannelState::outlier);
  EXPECT_EQ(aftermath(0.8, 2.0, 9.0), ChannelState::outlier) << "less than half of the speed";
  EXPECT_EQ(aftermath(0.3, 0.4, 9.0), ChannelState::ok);
  EXPECT_EQ(aftermath(0.12, 0.1, 9.0), ChannelState::ok);
  EXPECT_EQ(aftermath(0.08, 0.1, 9.0), ChannelState::outlier) << "less than 0.1 m/s";
}

/// Whether axes that freeze after some noise are found. @param change by the noise [m/s^2], now and then 0.6 of it;
/// @param lost the vertical axis is not known any more then.
bool findsFrozen(bool has_vertical, bool x_freezes, bool z_freezes, double change, bool lost = false) {
  AccelerationMonitor monitor{FaultParameters{}};
  const auto check = [&](double x, double z) {
    Observation y;
    y.acceleration_x = x;
    if (has_vertical) y.acceleration_z = kGravity + z;
    monitor.check(y, true, 0.5, kStep);
    return monitor.frozen();
  };
  double value = 0.0;
  for (int k = 0; k < 200; ++k) {
    value += (k % 40 < 2 ? 0.6 : 1.0) * (k % 2 == 0 ? change : -change);
    check(value, value);
  }
  has_vertical = has_vertical && !lost;
  bool found = false;
  for (int k = 0; k < 100; ++k) {
    value += k % 2 == 0 ? change : -change;
    found |= check(x_freezes ? 0.0 : value, z_freezes ? 0.0 : value);
  }
  return found;
}

TEST(AccelerationMonitor, EitherAxisCanFreeze) {
  EXPECT_TRUE(findsFrozen(true, true, false, 0.05));
  EXPECT_TRUE(findsFrozen(true, false, true, 0.05));
  EXPECT_TRUE(findsFrozen(true, true, true, 0.05));
  EXPECT_TRUE(findsFrozen(false, true, false, 0.05));
  EXPECT_FALSE(findsFrozen(true, false, false, 0.05));
  EXPECT_FALSE(findsFrozen(false, false, true, 0.05)) << "an unknown axis";
  EXPECT_FALSE(findsFrozen(true, false, false, 0.05, true)) << "an axis that is unknown again";
}

TEST(AccelerationMonitor, ChangesBelowAMillionthAreNoNoise) {
  EXPECT_TRUE(findsFrozen(false, true, false, 2.2e-6));
  EXPECT_FALSE(findsFrozen(false, true, false, 0.95e-6));
}

TEST(AccelerationMonitor, ABodyIsShakenForAFifthOfASecondAfterAJolt) {
  QuietBody body(false, true);
  body.speed = 1.0;
  EXPECT_FALSE(body.monitor.shaken());
  body.measure(1, 0.0);
  EXPECT_FALSE(body.monitor.shaken());
  body.measure(250, 0.0);
  body.measure(1, -24.0);
  EXPECT_TRUE(body.monitor.shaken());
  body.measure(8, 0.0);
  EXPECT_TRUE(body.monitor.shaken());
  body.measure(3, 0.0);
  EXPECT_FALSE(body.monitor.shaken());
  body.measure(20, 24.0);
  ASSERT_EQ(body.monitor.state(), ChannelState::faulty);
  EXPECT_FALSE(body.monitor.shaken()) << "who believes an accelerometer that is faulty";
}

}  // namespace
}  // namespace jackal_aic
