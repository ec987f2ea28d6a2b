#include "jackal_aic/faults/body_monitor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "jackal_aic/model/gravity.hpp"

namespace jackal_aic::faults {
namespace {

constexpr double kTrack = 0.55, kStep = 0.02;
constexpr double kTurn = 0.5;              // x [m/s]
constexpr double kAsked = kTurn / kTrack;  // rad/s

/// A body on its wheels, of which the gyro and the accelerometer read what a test says.
class Body {
 public:
  explicit Body(bool on_box = false) : monitor(FaultParameters{}, kTrack, on_box) {}

  /// A sample at wheels of x and v [m/s]. @param yaw_rate [rad/s], acceleration [m/s^2] of the body, without noise.
  void sample(double x, double v, double yaw_rate, double acceleration = 0.0) {
    const double dv = (v - v_) / kStep, dx = (x - x_) / kStep;
    monitor.predict(dv, {dv, dv}, dx, kStep);
    v_ = v;
    x_ = x;
    Observation y;
    y.yaw_rate = yaw_rate + 0.005 * normal_(random_);
    y.acceleration_x = acceleration + dv + 0.05 * normal_(random_);
    y.acceleration_z = kGravity + 0.05 * normal_(random_);
    if (change) change(y);
    WheelMotion wheels;
    wheels.difference = {x, 2e-6};
    wheels.forward = {v, 5e-7};
    wheels.turn = x != 0.0 || v != 0.0;
    wheels.to_stand = to_stand;
    monitor.check(y, wheels, kStep);
  }

  /// A steady turn. @param slip of the turn in multiples of the one given; @param bias of the gyro [rad/s].
  ChannelState turn(double x, double slip, double bias, int samples) {
    for (; samples > 0; --samples) sample(x, 0.0, slip * x / kTrack + bias);
    return monitor.gyro();
  }

  BodyMonitor monitor;
  bool to_stand = false;
  std::function<void(Observation&)> change;  // of what is read

 private:
  double v_ = 0.0, x_ = 0.0;
  std::mt19937 random_{1};
  std::normal_distribution<double> normal_;
};

/// Turns, and then lets the gyro read a part of the turn for a second. @param change of the yaw rate on the way there
/// [rad/s^2].
ChannelState afterLosing(double part, double change) {
  Body body;
  body.turn(kTurn, 1.0, 0.0, 200);
  double yaw_rate = kAsked;
  for (int k = 0; k < 50 && body.monitor.gyro() != ChannelState::faulty; ++k) {
    yaw_rate += std::clamp(part * kAsked - yaw_rate, -change * kStep, change * kStep);
    body.sample(kTurn, 0.0, yaw_rate);
  }
  return body.monitor.gyro();
}

TEST(BodyMonitor, AGyroOfAnUnknownSignDoesNotReturnOnAStraightLine) {
  for (const double sign : {1.0, -1.0}) {
    Body body;
    for (int k = 0; k < 100; ++k) body.sample(0.0, 0.5, 0.0);
    for (int k = 0; k <= 10; ++k) body.sample(0.015 * k * kTrack, 0.5, 0.015 * k);
    for (int k = 0; k < 50; ++k) body.sample(0.15 * kTrack, 0.5, 0.15 + 0.5 * sign);
    ASSERT_EQ(body.monitor.gyroFault(), kGyroOffset) << sign;
    for (int k = 0; k < 200; ++k) body.sample(0.0, 0.5, 0.0);
    EXPECT_EQ(body.monitor.gyroFault() == kHealthy, sign > 0.0) << "both signs read zero";
    for (int k = 0; k < 100; ++k) body.sample(kTurn, 0.5, kAsked);
    EXPECT_EQ(body.monitor.gyroFault(), kHealthy) << "it reads the turn " << sign;
  }
}

TEST(BodyMonitor, DoubtHasANameBeforeTheVerdictAndUntilTheReturn) {
  Body body;
  body.turn(kTurn, 1.0, 0.0, 200);
  EXPECT_EQ(body.monitor.mostLikely().hypothesis, kHealthy);
  int doubtful = 0;
  for (int k = 0; k < 25 && body.monitor.gyroFault() == kHealthy; ++k) {
    body.turn(kTurn, 1.0, 0.3, 1);
    const Suspicion suspicion = body.monitor.mostLikely();
    if (suspicion.hypothesis != kGyroOffset || body.monitor.gyroFault() != kHealthy) continue;
    ++doubtful;
    EXPECT_EQ(suspicion.probability, body.monitor.probability(kGyroOffset) + body.monitor.probability(kGyroShifted));
  }
  EXPECT_GT(doubtful, 1) << "before the verdict";
  ASSERT_EQ(body.monitor.gyroFault(), kGyroOffset);
  EXPECT_EQ(body.monitor.mostLikely().hypothesis, kGyroOffset);
  EXPECT_GT(body.monitor.gyroFaulty(), 0.99);
  body.turn(kTurn, 1.0, 0.0, 100);
  EXPECT_EQ(body.monitor.mostLikely().hypothesis, kHealthy);
  EXPECT_LT(body.monitor.gyroFaulty(), 0.01);
  EXPECT_EQ((Suspicion{kGyroOffset, 0.6}.text()), "perhaps: gyro offset, 0.60");
  EXPECT_EQ((Suspicion{kHealthy, 0.98}.text()), "healthy, 0.98");
}

TEST(BodyMonitor, ABodyThatIsStruckByAxleAfterAxleOrTakenBackIsNoFault) {
  for (const bool held : {true, false}) {  // by a kerb until the second axle is past
    Body body;
    body.turn(kTurn, 1.0, 0.0, 200);
    double thrown = 0.3;  // rad/s
    for (int k = 0; k < 100; ++k) {
      if (k > (held ? 7 : 0)) thrown *= held ? 0.9 : std::exp(-kStep / 0.1);
      const double jolt = held ? (k == 0 ? 6.0 : k == 8 ? -6.0 : 0.0) : k < 3 ? 8.0 : 0.0;
      body.sample(kTurn, 0.0, kAsked + thrown, jolt);
      ASSERT_NE(body.monitor.gyro(), ChannelState::faulty) << held << ", " << k;
    }
    EXPECT_EQ(body.monitor.gyro(), ChannelState::ok);
  }
}

TEST(BodyMonitor, ABodyThatSlidesIsNoFaultOfTheGyro) {
  EXPECT_EQ(afterLosing(0.0, 3.0), ChannelState::ok) << "the wheels turn, and the body comes to a stop";
  EXPECT_EQ(afterLosing(0.4, 3.0), ChannelState::ok);
  EXPECT_EQ(afterLosing(0.4, 1e3), ChannelState::faulty) << "no body stops in no time";
}

TEST(BodyMonitor, AnotherGroundIsNoFaultOfTheGyro) {
  for (const double change : {-0.2, 0.2}) {
    Body body;
    body.turn(1.375, 1.0, 0.0, 200);  // 2.5 rad/s
    for (int k = 1; k <= 5; ++k) body.turn(1.375, 1.0 + 0.2 * k * change, 0.0, 1);
    for (int k = 0; k < 100; ++k) ASSERT_NE(body.turn(1.375, 1.0 + change, 0.0, 1), ChannelState::faulty) << change;
    EXPECT_EQ(body.monitor.gyro(), ChannelState::ok);
  }
}

TEST(BodyMonitor, FindsAnOffsetOfTheGyroBeyondTheLargestBias) {
  Body biased;
  biased.turn(0.0, 1.0, 0.0, 200);
  for (int k = 0; k < 500; ++k) ASSERT_NE(biased.turn(0.0, 1.0, 0.03, 1), ChannelState::faulty) << k;
  for (const double x : {0.0, 0.275}) {
    for (const double bias : {0.2, -0.2}) {
      Body body;
      body.turn(x, 1.0, 0.0, 200);
      EXPECT_EQ(body.turn(x, 1.0, bias, 15), ChannelState::faulty) << x << " m/s, " << bias;
      EXPECT_EQ(body.monitor.gyroFault(), kGyroOffset);
      EXPECT_EQ(body.turn(0.0, 1.0, bias, 200), ChannelState::faulty) << "whatever the robot does";
      EXPECT_EQ(body.turn(0.0, 1.0, 0.0, 100), ChannelState::ok) << "it agrees again";
    }
  }
}

TEST(BodyMonitor, UnlikeTyresAreNoBias) {
  Body body;
  double v = 0.0;
  const auto drive = [&](double target, double bias, int samples) {
    for (; samples > 0; --samples) {
      v += std::clamp(target - v, -0.03, 0.03);
      body.sample(0.0, v, 0.02 * v / kTrack + bias);  // of 2 % difference
      if (body.monitor.gyro() == ChannelState::faulty) return ChannelState::faulty;
    }
    return body.monitor.gyro();
  };
  drive(0.0, 0.0, 200);
  EXPECT_EQ(drive(1.8, 0.0, 3000), ChannelState::ok);
  EXPECT_EQ(drive(0.0, 0.0, 200), ChannelState::ok);
  EXPECT_EQ(drive(1.8, 0.0, 200), ChannelState::ok);
  EXPECT_EQ(drive(1.8, 0.2, 20), ChannelState::faulty) << "a bias still is";
}

TEST(BodyMonitor, FindsWhatIsWrongWithTheAccelerometer) {
  const auto offset = [](Observation& y) { y.acceleration_x += 5.0; };
  const auto vertical_offset = [](Observation& y) { *y.acceleration_z += 5.0; };
  const auto freeze = [](Observation& y) { y.acceleration_x = 0.3, y.acceleration_z = 9.7; };
  const auto turn_over = [](Observation& y) { y.acceleration_z = -*y.acceleration_z, y.yaw_rate = -y.yaw_rate; };
  struct Case {
    std::function<void(Observation&)> change;
    Hypothesis fault;
  };
  const Case cases[] = {{offset, kAccelerometerOffset},
                        {vertical_offset, kAccelerometerOffset},
                        {freeze, kAccelerometerFrozen},
                        {turn_over, kUpsideDown}};
  for (const Case& c : cases) {
    Body body;
    for (int k = 0; k < 200; ++k) body.sample(kTurn, 0.5, kAsked);
    ASSERT_EQ(body.monitor.accelerometer(), ChannelState::ok);
    body.change = c.change;
    for (int k = 0; k < 20; ++k) body.sample(kTurn, 0.5, kAsked);
    EXPECT_EQ(body.monitor.accelerometerFault(), c.fault);
    body.change = nullptr;
    for (int k = 0; k < 150; ++k) body.sample(kTurn, 0.5, kAsked);
    EXPECT_EQ(body.monitor.accelerometer(), ChannelState::ok) << "it agrees again";
  }
}

}  // namespace
}  // namespace jackal_aic::faults
