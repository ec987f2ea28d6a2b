#include "jackal_aic/faults/wheel_monitor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "jackal_aic/model/wheel_belief.hpp"

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;   // s
constexpr double kRadius = 0.098;  // m
const SampleStep kStep(kPeriod, FaultParameters{}.covariance_time_constant);

PlantModel model() {
  PlantModel m;
  m.dead_time = 0.08;
  m.lag = 0.01;
  m.acceleration_limit = 1.65;
  m.identified = true;
  return m;
}

/// A wheel, and the monitor that watches its encoder.
class WatchedWheel {
 public:
  explicit WatchedWheel(const PlantModel& real = model(), const FaultParameters& parameters = {})
      : monitor(parameters, model(), kRadius), wheel_(real, kRadius, {}) {
    monitor.start(0.0);
  }

  /// Drives for some samples; returns how many of them did not count. @param measured makes of the true speed
  /// [rad/s] what the encoder says.
  template <class Measured>
  int drive(double command, int samples, Measured measured) {
    int left_out = 0;
    for (int i = 0; i < samples; ++i) {
      for (int k = 0; k < 20; ++k) {
        monitor.predict(command);
        wheel_.predict(command);
      }
      const double y = measured(wheel_.speed());
      monitor.compare(y, kPeriod);
      monitor.conclude(y, kStep);
      left_out += monitor.state() == ChannelState::ok ? 0 : 1;
    }
    return left_out;
  }

  int drive(double command, int samples) {
    return drive(command, samples, [this](double speed) { return speed + noise(); });
  }

  double noise() { return 0.03 * normal_(random_); }

  WheelMonitor monitor;

 private:
  WheelBelief wheel_;
  std::mt19937 random_{3};
  std::normal_distribution<double> normal_{0.0, 1.0};
};

TEST(WheelMonitor, AWheelThatIsEarlierOrLaterThanItsModelIsNoFault) {
  for (const double dead_time : {0.01, 0.04, 0.12, 0.16}) {
    PlantModel real = model();
    real.dead_time = dead_time;
    WatchedWheel wheel(real);
    int left_out = 0;
    for (const double command : {5.0, -5.0, 10.0, 0.0, -8.0, 8.0, 0.0}) left_out += wheel.drive(command, 75);
    EXPECT_EQ(left_out, 0) << dead_time;
  }
}

TEST(WheelMonitor, AnEncoderThatHoldsItsValueIsBelievedUpAndDown) {
  WatchedWheel wheel;
  int k = 0;
  double held = 0.0;
  const auto holds = [&](double speed) {
    if (k++ % 3 == 0) held = speed + wheel.noise();
    return held;
  };
  for (const double command : {5.0, -5.0, 0.0}) wheel.drive(command, 75, holds);  // it learns for how long
  for (const double command : {5.0, -5.0, 10.0, 0.0, -10.0, 0.0, 3.0, 0.0}) {
    EXPECT_EQ(wheel.drive(command, 75, holds), 0) << "to " << command;
  }
}

TEST(WheelMonitor, AFineEncoderThatStaysWhereItWasWhileItsWheelMovesIsFrozen) {
  for (const double direction : {1.0, -1.0}) {
    WatchedWheel wheel;
    const auto quantised = [&](double speed) { return 0.1 * std::round((speed + wheel.noise()) / 0.1); };
    wheel.drive(5.0 * direction, 150, quantised);
    wheel.drive(8.0 * direction, 40, [&](double) { return 5.0 * direction; });
    EXPECT_TRUE(wheel.monitor.frozen()) << direction;
    EXPECT_EQ(wheel.monitor.state(), ChannelState::faulty);
  }
}

TEST(WheelMonitor, ACoarseEncoderDoesNotMissWhatIsSmallerThanItsSteps) {
  WatchedWheel wheel;
  const auto quantised = [](double speed) { return 0.2 * std::round(speed / 0.2); };
  wheel.drive(5.0, 150, quantised);
  for (const double command : {5.05, 4.95, 5.08}) {
    EXPECT_EQ(wheel.drive(command, 100, quantised), 0) << command;
    EXPECT_FALSE(wheel.monitor.frozen());
  }
}

TEST(WheelMonitor, AWheelThatSomebodyElseDrivesIsFollowed) {
  WatchedWheel wheel;
  wheel.drive(0.0, 50);
  wheel.monitor.follow(6.0);
  EXPECT_NEAR(wheel.monitor.speed(), 6.0, 1e-9);
  for (int k = 0; k < 20; ++k) wheel.monitor.predict(6.0);
  wheel.monitor.compare(6.0, kPeriod);
  EXPECT_FALSE(wheel.monitor.suspect());
  EXPECT_LT(wheel.monitor.turns(false).variance, 0.1) << "it does not come from rest";
}

TEST(WheelMonitor, AWheelThatCreepsTurnsAsMeasuredWithinTheNoise) {
  WheelMonitor wheel(FaultParameters{}, model(), kRadius);
  wheel.start(0.0);
  for (int k = 0; k < 50; ++k) {
    for (int step = 0; step < 20; ++step) wheel.predict(0.0);
    wheel.compare(0.12 + 0.001 * (k % 3), 0.02);
    EXPECT_NEAR(wheel.turns(true).mean, 0.12, 0.04) << "the sides' errors add up to a turn";
  }
}

/// Stiction: a wheel that stands starts at 0.75 rad/s, and one that turns goes on down to rest.
TEST(WheelMonitor, AWheelThatSticksAtASmallCommandAndThenStartsIsNoFault) {
  for (const double sign : {1.0, -1.0}) {
    WatchedWheel wheel;
    bool stands = true;
    const auto sticks = [&](double speed) {
      stands = stands ? std::abs(speed) < 0.75 : std::abs(speed) < 0.02;
      return stands ? 0.0 : speed + wheel.noise();
    };
    const auto coarse = [&](double speed) { return 0.06 * std::round(sticks(speed) / 0.06); };
    wheel.drive(3.0 * sign, 100, coarse);
    int left_out = 0;
    for (int k = 0; k < 100; ++k) left_out += wheel.drive(sign * (0.2 - 0.01 * k), 1, coarse);  // to the other side
    for (int k = 0; k < 100; ++k) left_out += wheel.drive(sign * (-0.8 + 0.01 * k), 1, coarse);
    EXPECT_EQ(left_out, 0) << sign;
  }
}

TEST(WheelMonitor, AnUnidentifiedDriveTrainMayBeSlow) {
  PlantModel unknown = model();
  unknown.identified = false;
  PlantModel soft = model();
  soft.lag = 0.25;
  WheelMonitor monitor({}, unknown, kRadius);
  WheelBelief wheel(soft, kRadius, {});
  monitor.start(0.0);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  int left_out = 0;
  for (const double command : {3.0, -3.0, 5.0, 0.0}) {
    for (int i = 0; i < 100; ++i) {
      for (int k = 0; k < 20; ++k) {
        monitor.predict(command);
        wheel.predict(command);
      }
      const double y = wheel.speed() + 0.03 * normal(random);
      monitor.compare(y, kPeriod);
      monitor.conclude(y, kStep);
      left_out += monitor.state() == ChannelState::ok ? 0 : 1;
    }
  }
  EXPECT_EQ(left_out, 0);
}

/// A monitor whose distances are known from the formulas of the headers: it sees what it is shown, and no noise.
class Wheel {
 public:
  explicit Wheel(const PlantModel& told = model(), const FaultParameters& parameters = {})
      : monitor(parameters, told, kRadius) {
    monitor.start(0.0);
  }

  /// Lets time pass [s].
  Wheel& pass(double command, double duration) {
    for (long k = std::lround(duration / 0.001); k > 0; --k) monitor.predict(command);
    return *this;
  }

  /// Shows a speed that says nothing.
  void look(double command, double measurement) {
    pass(command, kPeriod);
    monitor.compare(measurement, kPeriod);
  }

  /// Drives as predicted, for some samples.
  Wheel& follow(double command, int samples) {
    for (; samples > 0; --samples) {
      pass(command, kPeriod);
      show(monitor.speed());
    }
    return *this;
  }

  /// Starts at a speed and keeps it for long. Nothing is known of the encoder's resolution then.
  Wheel& keep(double speed) {
    monitor.start(speed);
    for (int k = 0; k < 300; ++k) pass(speed, kPeriod).show(speed);
    return *this;
  }

  /// Shows a speed now.
  void show(double measurement) {
    monitor.compare(measurement, kPeriod);
    monitor.conclude(measurement, kStep);
  }

  /// The distance that a speed would have now.
  double distanceOf(double measurement) const {
    WheelMonitor copy = monitor;
    copy.compare(measurement, kPeriod);
    return copy.distance();
  }

  /// Where the band of speeds ends that need no noise to be explained. @param way 1 or -1.
  double edge(double inside, double way) const {
    double in = inside, out = inside + 40.0 * way;
    for (int k = 0; k < 60; ++k) (distanceOf(0.5 * (in + out)) == 0.0 ? in : out) = 0.5 * (in + out);
    return in;
  }

  WheelMonitor monitor;
};

FaultParameters exactParameters() {
  FaultParameters p;
  p.dead_time_deviation = 0.0;
  p.slowest_acceleration = p.fastest_acceleration = 1.0;
  return p;
}

/// Lets a number of steps pass, each of them for itself.
void predict(ReachableSpeeds& reachable, double command, long number) {
  ReachableSpeeds::Steps steps;
  for (; number > 0; --number) reachable.predict(command, 1, steps);
}

/// Compares the band of a monitor during steps of the command with that of a range of drive trains.
void expectBand(const PlantModel& told, const DriveTrainRange& range, double gain, double offset) {
  Wheel wheel(told);
  ReachableSpeeds reachable(told, kRadius, range);
  for (const double command : {10.0, -10.0, 3.0}) {
    for (int k = 1; k <= 50; ++k) {
      wheel.pass(command, kPeriod);
      predict(reachable, command, 20);
      double low = reachable.low(), high = reachable.high();
      if (low <= 0.8 && high >= -0.8) low = std::min(low, 0.0), high = std::max(high, 0.0);  // stiction
      low = std::min(low, reachable.low() - gain * std::abs(reachable.low()) - offset);
      high = std::max(high, reachable.high() + gain * std::abs(reachable.high()) + offset);
      const double inside = wheel.monitor.speed();
      ASSERT_NEAR(wheel.edge(inside, -1.0), low, 1e-4) << command << ", " << k;
      ASSERT_NEAR(wheel.edge(inside, 1.0), high, 1e-4) << command << ", " << k;
    }
  }
}

TEST(WheelMonitor, AnIdentifiedDriveTrainIsWithinThreeDeviationsOfItsTiming) {
  expectBand(model(), {0.09, 0.09, 0.01, 0.01, 0.5, 3.0}, 0.0, 0.0);
}

TEST(WheelMonitor, ALagBeyondThatOfMotorsIsKnownWithTheDeadTimeAtBest) {
  PlantModel heavy = model();
  heavy.dead_time = 0.2;
  heavy.lag = 0.3;
  expectBand(heavy, {0.19, 0.19, 0.2, 0.5, 0.5, 3.0}, 0.0, 0.0);
}

TEST(WheelMonitor, ADriveTrainThatNobodyIdentifiedIsWithinItsHalfAndItsDouble) {
  PlantModel unknown = model();
  unknown.identified = false;
  unknown.dead_time = 0.2;
  unknown.lag = 0.03;
  expectBand(unknown, {0.19, 0.29, 0.015, 0.36, 0.5, 3.0}, 0.25, 0.5);
}

TEST(WheelMonitor, StartsAtItsSpeedAndWithNoFault) {
  for (const double speed : {5.0, -3.0}) {
    Wheel wheel;
    wheel.follow(8.0, 100);
    for (int k = 0; k < 10; ++k) wheel.show(0.0);
    ASSERT_EQ(wheel.monitor.state(), ChannelState::faulty);
    wheel.monitor.start(speed);
    EXPECT_EQ(wheel.monitor.state(), ChannelState::ok);
    EXPECT_FALSE(wheel.monitor.suspect() || wheel.monitor.frozen() || wheel.monitor.recovering());
    EXPECT_FALSE(wheel.monitor.suspecting());
    EXPECT_NEAR(wheel.monitor.speed(), speed, 1e-12);
    for (int k = 0; k < 20; ++k) {  // with the command that has been driving it for long
      wheel.pass(speed, kPeriod);
      ASSERT_NEAR(wheel.monitor.speed(), speed, 1e-9);
      ASSERT_NEAR(wheel.edge(speed, 1.0), speed, 1e-6);
      ASSERT_NEAR(wheel.edge(speed, -1.0), speed, 1e-6);
      ASSERT_LT(wheel.monitor.turns(false).variance, 0.1);
    }
  }
}

TEST(WheelMonitor, StartsUnderWayWithTheCommandsBefore) {
  Wheel wheel(model(), exactParameters());
  for (int k = 0; k < 10; ++k) wheel.show(7.0);
  ASSERT_EQ(wheel.monitor.state(), ChannelState::faulty);
  wheel.pass(9.0, 0.3);
  wheel.monitor.startUnderWay(3.0);
  EXPECT_NEAR(wheel.monitor.speed(), 3.0, 1e-12);
  wheel.pass(9.0, 0.1);
  const double expected = 3.0 + 0.1 * 1.65 / kRadius;  // at the acceleration limit
  EXPECT_NEAR(wheel.monitor.speed(), expected, 0.01);
  EXPECT_NEAR(wheel.edge(wheel.monitor.speed(), 1.0), expected, 0.01);
  EXPECT_NEAR(wheel.edge(wheel.monitor.speed(), -1.0), expected, 0.01);
  EXPECT_EQ(wheel.monitor.state(), ChannelState::ok);
  wheel.monitor.compare(expected + 0.1, kPeriod);
  EXPECT_TRUE(wheel.monitor.fasterThanCommanded());
  wheel.monitor.compare(expected - 0.1, kPeriod);
  EXPECT_FALSE(wheel.monitor.fasterThanCommanded());
}

/// After a stall, or a time without measurements, only its first speed shows where the wheel is. A gain that
/// is not quite the model's, or what a turn on the spot takes of the motors, is no motion that the encoder misses.
TEST(WheelMonitor, AQuietWheelThatIsOffItsModelIsNotFrozenWhenItIsFoundUnderWay) {
  constexpr double kCoarse = 0.02, kSlowPeriod = 0.05;  // rad/s, s
  for (const double gain : {0.93, 1.07}) {
    Wheel wheel;
    const double speed = kCoarse * std::round(2.0 * gain / kCoarse);
    wheel.keep(2.0);
    for (int k = 0; k < 40; ++k) wheel.look(2.0, speed + (k % 2) * kCoarse);  // tells the resolution
    wheel.monitor.startUnderWay(speed);
    wheel.show(speed);
    for (int k = 0; k < 20; ++k) {
      wheel.pass(2.0, kSlowPeriod);
      wheel.monitor.compare(speed, kSlowPeriod);
      wheel.monitor.conclude(speed, SampleStep(kSlowPeriod, FaultParameters{}.covariance_time_constant));
      EXPECT_EQ(wheel.monitor.state(), ChannelState::ok) << gain << ", sample " << k;
    }
  }
}

/// A wheel of a Warthog that turns on the spot is dragged along by the other side, against a small command; one that
/// stands under it is blocked, although its belief was led there.
TEST(WheelMonitor, AWheelThatTheOtherSideDragsIsNotBehindAndOneThatStandsIs) {
  constexpr int kRamp = 500;
  constexpr double kCommand = -1.35;  // rad/s
  for (const double dragged : {0.7, 0.0}) {
    WatchedWheel wheel;
    wheel.drive(0.0, 500);
    int left_out = 0;
    const auto look = [&](double share) {
      return wheel.drive(share * kCommand, 1, [&](double) { return share * dragged + wheel.noise(); });
    };
    for (int k = 0; k < kRamp; ++k) left_out += look(static_cast<double>(k) / kRamp);
    EXPECT_EQ(left_out, 0) << dragged << ", led away slowly";
    for (int k = 0; k < 50; ++k) look(1.0);
    EXPECT_EQ(wheel.monitor.state(), dragged == 0.0 ? ChannelState::faulty : ChannelState::ok) << dragged;
  }
}

TEST(WheelMonitor, AnEncoderThatIsFoundFrozenUnderWayMissesWhatTheCommandsChange) {
  for (const double change : {1.0, -1.0}) {
    Wheel wheel;
    wheel.keep(5.0);
    for (int k = 0; k < 40; ++k) wheel.look(5.0, 5.0 + (k % 2) * 0.02);
    wheel.monitor.startUnderWay(5.0);
    for (int k = 0; k < 5; ++k) wheel.pass(5.0, kPeriod).show(5.0);
    int samples = 1;
    for (; samples < 100 && !wheel.monitor.frozen(); ++samples) wheel.pass(5.0 + change, kPeriod).show(5.0);
    EXPECT_LE(samples * kPeriod, 0.5) << "dead time and patience";
  }
}

TEST(WheelMonitor, ForgettingStartsAtRest) {
  Wheel wheel;
  wheel.follow(8.0, 100);
  for (int k = 0; k < 10; ++k) wheel.show(0.0);
  wheel.monitor.forget(model(), kRadius);
  EXPECT_EQ(wheel.monitor.speed(), 0.0);
  EXPECT_EQ(wheel.monitor.state(), ChannelState::ok);
  wheel.pass(0.0, kPeriod);
  EXPECT_NEAR(wheel.edge(0.0, 1.0), 0.0, 1e-6);
}

TEST(WheelMonitor, ForgivenItBelievesWhatItMeasured) {
  Wheel wheel;
  wheel.follow(8.0, 100);
  for (int k = 0; k < 10; ++k) wheel.show(12.0);
  ASSERT_TRUE(wheel.monitor.fasterThanCommanded());
  wheel.monitor.forgive();
  EXPECT_EQ(wheel.monitor.state(), ChannelState::ok);
  EXPECT_NEAR(wheel.monitor.speed(), 12.0, 1e-12);
  EXPECT_FALSE(wheel.monitor.fasterThanCommanded());
}

TEST(WheelMonitor, IsFasterThanCommandedBeyondAllThatTheCommandsMayHaveGivenIt) {
  for (const double sign : {1.0, -1.0}) {
    Wheel wheel;
    wheel.follow(sign * 8.0, 100);
    wheel.pass(sign * 2.0, 0.2);  // may be anywhere between the two
    wheel.show(sign * 7.0);
    EXPECT_FALSE(wheel.monitor.fasterThanCommanded());
    wheel.show(sign * 8.5);
    EXPECT_TRUE(wheel.monitor.fasterThanCommanded());
    wheel.show(sign * -8.5);
    EXPECT_TRUE(wheel.monitor.fasterThanCommanded());
  }
}

TEST(WheelMonitor, IsCommandedToRestOnceNoDriveTrainMayTurnAnyMore) {
  for (const double sign : {1.0, -1.0}) {
    Wheel wheel;
    wheel.follow(sign * 5.0, 100);
    EXPECT_FALSE(wheel.monitor.commandedToRest());
    wheel.pass(0.0, 0.4);
    EXPECT_FALSE(wheel.monitor.commandedToRest()) << "half of the limit: 0.6 s, and the dead time";
    wheel.pass(0.0, 1.0);
    EXPECT_TRUE(wheel.monitor.commandedToRest());
    wheel.pass(sign * 0.4, 2.0);
    EXPECT_TRUE(wheel.monitor.commandedToRest());
    wheel.pass(sign * 0.6, 2.0);
    EXPECT_FALSE(wheel.monitor.commandedToRest());
  }
}

TEST(WheelMonitor, AFaultyWheelThatStandsDoesNotRecover) {
  Wheel wheel;
  wheel.follow(8.0, 100);
  for (int k = 0; k < 10; ++k) wheel.show(0.0);
  wheel.pass(0.0, 2.0);
  EXPECT_EQ((wheel.follow(0.0, 100), wheel.monitor.state()), ChannelState::faulty);
  EXPECT_EQ((wheel.follow(8.0, 100), wheel.monitor.state()), ChannelState::ok);
}

// Variances.

TEST(WheelMonitor, WithoutMeasurementsItIsUnsureUpToALimit) {
  Wheel wheel(model(), exactParameters());
  wheel.follow(5.0, 200);
  EXPECT_LT(wheel.monitor.turns(false).variance, 1e-3);
  wheel.pass(5.0, 600.0);
  EXPECT_NEAR(wheel.monitor.turns(false).variance, 0.3 * 0.3, 1e-6);
}

TEST(WheelMonitor, TheResolutionOfAnEncoderDoesNotAverageOut) {
  const auto uncertainty = [](double step) {
    Wheel wheel(model(), exactParameters());
    wheel.keep(5.0);
    for (int k = 0; k < 20; ++k) wheel.look(5.0, 5.0 + (k % 2) * step);
    return wheel.monitor.turns(false).variance;
  };
  const double fine = uncertainty(1e-4);
  EXPECT_NEAR(uncertainty(0.1) - fine, 0.1 * 0.1 / 12.0, 1e-6);
  EXPECT_NEAR(uncertainty(0.5) - fine, 0.2 * 0.2 / 12.0, 1e-6) << "coarser than any encoder";
}

TEST(WheelMonitor, ANoisierEncoderIsTrustedLess) {
  FaultParameters noisy = exactParameters();
  noisy.wheel_variance = 0.09;
  Wheel usual(model(), exactParameters()), other(model(), noisy);
  usual.follow(5.0, 200);
  other.follow(5.0, 200);
  EXPECT_GT(other.monitor.turns(false).variance, 2.0 * usual.monitor.turns(false).variance);
  EXPECT_NEAR(other.distanceOf(7.0), 2.0 / (5.0 * std::sqrt(0.09 + other.monitor.turns(false).variance)), 0.02);
}

TEST(WheelMonitor, AGainThatIsNotTheModelsMakesAChangeOfTheSpeedUncertain) {
  Wheel wheel(model(), exactParameters());
  wheel.follow(0.0, 400);
  wheel.follow(10.0, 36);  // it has just arrived
  const double limit = 1.65 / kRadius, time = 10.0 / limit;
  const double arrived = wheel.monitor.speed();
  ASSERT_NEAR(arrived, 10.0, 0.3);
  wheel.pass(10.0, kPeriod);
  const double since = 37 * kPeriod - model().dead_time - time;
  const double change = 0.1 * limit * 0.5 * (1.0 - std::exp(-time / 0.5)) * std::exp(-since / 0.5);
  const double deviation = std::sqrt(wheel.monitor.turns(false).variance + 9e-4 + change * change);
  EXPECT_NEAR(wheel.distanceOf(wheel.monitor.speed() + 3.0), 3.0 / (5.0 * deviation), 0.03);
}

// What the model is usually off by.

TEST(WheelMonitor, WhatAModelIsUsuallyOffByIsNoFault) {
  const auto band = [](double time) {
    Wheel wheel(model(), exactParameters());
    wheel.follow(10.0, 300);
    double speed = 10.0;
    for (; speed > 8.0; speed -= 0.01) {  // slower and slower
      wheel.pass(10.0, kPeriod);
      wheel.show(speed);
    }
    for (long k = std::lround(time / kPeriod); k > 0; --k) {
      wheel.pass(10.0, kPeriod);
      wheel.show(speed);
    }
    EXPECT_EQ(wheel.monitor.state(), ChannelState::ok);
    wheel.pass(10.0, kPeriod);
    const double believed = wheel.monitor.speed();
    EXPECT_NEAR(believed, speed, 0.05);
    const double up = wheel.edge(believed, 1.0) - believed, down = believed - wheel.edge(believed, -1.0);
    EXPECT_NEAR(up, down, 1e-3);
    return up;
  };
  // Three times the root mean square, noise apart, less 0.3 rad/s, learned within 10 s.
  const double off = 2.0 - 3.0 * std::sqrt(2e-3);
  EXPECT_NEAR(band(60.0), 3.0 * off - 0.3, 0.15);
  const double on_the_way = off * off / 3.0 * 0.33;  // 4 s of a ramp
  const double after = off * off + (on_the_way - off * off) * std::exp(-0.5);
  EXPECT_NEAR(band(5.0), 3.0 * std::sqrt(after) - 0.3, 0.2);
}

TEST(WheelMonitor, AWheelThatStandsTellsNothingOfTheModel) {
  Wheel wheel(model(), exactParameters());
  wheel.follow(0.0, 300);
  for (double speed = 0.0; speed < 0.45; speed += 0.001) {
    wheel.pass(0.0, kPeriod);
    wheel.show(speed);
  }
  for (int k = 0; k < 1000; ++k) {
    wheel.pass(0.0, kPeriod);
    wheel.show(0.45);
  }
  wheel.pass(0.0, kPeriod);
  EXPECT_NEAR(wheel.edge(wheel.monitor.speed(), 1.0), wheel.monitor.speed(), 0.01);
}

// Encoders that hold their value.

/// Shows values that change every some samples, and then a ramp; @returns how much the wheel may have moved since the
/// value was renewed. @param changes sizes of the changes, one after another.
double heldMotion(const std::vector<double>& changes, int samples) {
  Wheel wheel(model(), exactParameters());
  wheel.follow(0.0, 300);
  double value = 0.0;
  for (const double change : changes) {
    value += change;
    for (int k = 0; k < samples; ++k) wheel.look(0.0, value);
  }
  wheel.pass(10.0, 0.08 + 0.1);
  for (int k = 0; k < 10; ++k) wheel.look(10.0, value);
  return std::sqrt(wheel.monitor.turns(false).variance);
}

TEST(WheelMonitor, AHeldValueMayBeAnyThatWasPossibleSinceItWasRenewed) {
  const double limit = 1.65 / kRadius;
  const std::vector<double> rises(8, 0.5);
  EXPECT_NEAR(heldMotion(rises, 1), 0.0, 0.3);
  EXPECT_NEAR(heldMotion(rises, 5), 0.08 * limit, 0.1);
  EXPECT_NEAR(heldMotion(rises, 10), 0.18 * limit, 0.1);
}

TEST(WheelMonitor, AChangeThatIsNoNoiseTellsOfAHold) {
  const auto isLearned = [](const std::vector<double>& changes) { return heldMotion(changes, 5) > 0.7; };
  const auto afterKnown = [&](double quantum, double change) {  // its resolution first, to and fro
    std::vector<double> changes;
    for (int k = 0; k < 12; ++k) changes.push_back(k % 2 == 0 ? quantum : -quantum);
    changes.insert(changes.end(), 8, change);
    return isLearned(changes);
  };
  EXPECT_TRUE(isLearned(std::vector<double>(8, 0.15))) << "of an unknown resolution";
  EXPECT_FALSE(isLearned(std::vector<double>(8, 0.08)));
  EXPECT_TRUE(afterKnown(0.1, 0.4)) << "more than three steps";
  EXPECT_FALSE(afterKnown(0.1, 0.25));
  EXPECT_TRUE(afterKnown(0.5, 0.7)) << "coarser than any encoder";
  EXPECT_FALSE(afterKnown(0.01, 0.08));
}

TEST(WheelMonitor, TheBandOfAHeldValueIsThatOfTheLastTenthOfASecond) {
  Wheel wheel(model(), exactParameters());
  wheel.follow(0.0, 300);
  for (int k = 0; k < 40; ++k) wheel.look(0.0, 0.5 * (k / 5));  // renewed every 0.1 s
  std::vector<double> speeds;
  for (const double command : {10.0, -10.0, 5.0}) {
    for (int k = 0; k < 100; ++k) {
      wheel.pass(command, kPeriod);
      const double speed = wheel.monitor.speed();
      speeds.push_back(speed);
      if (speeds.size() >= 6 && std::abs(speed) > 1.0) {
        const auto [low, high] = std::minmax_element(speeds.end() - 5, speeds.end());
        if (*low * *high > 0.0 && std::min(std::abs(*low), std::abs(*high)) > 0.9) {
          ASSERT_NEAR(wheel.edge(speed, -1.0), *low, 1e-3) << command << ", " << k;
          ASSERT_NEAR(wheel.edge(speed, 1.0), *high, 1e-3) << command << ", " << k;
        }
      }
      wheel.monitor.compare(0.5 * (k / 5), kPeriod);
    }
  }
  wheel.monitor.start(0.0);
  wheel.pass(0.0, kPeriod);
  EXPECT_NEAR(wheel.edge(0.0, 1.0), 0.0, 1e-6) << "a start forgets what was before";
}

// Wheels that come back.

/// A wheel that stands off its prediction and comes back by a step per sample. @param off [rad/s], negative where it is
/// slower; @param rate [rad/s] per sample; @param hold samples for which its encoder holds a value.
/// @returns whether it is recovering with each of the samples.
std::vector<bool> comesBack(double off, double rate, int hold = 1, int samples = 40) {
  constexpr double kSpeed = 12.0;
  Wheel wheel(model(), exactParameters());
  wheel.follow(kSpeed, 300);
  if (hold > 1) {
    for (int k = 0; k < 8 * hold; ++k) wheel.look(kSpeed, kSpeed + 0.5 * (k / hold));
    wheel.look(kSpeed, kSpeed);
  }
  for (int k = 0; k < 10; ++k) wheel.look(kSpeed, kSpeed + off);
  EXPECT_TRUE(wheel.monitor.suspect());
  EXPECT_FALSE(wheel.monitor.recovering());
  std::vector<bool> recovering;
  for (int k = 0; k < samples; ++k) {
    wheel.look(kSpeed, kSpeed + off - (off > 0.0 ? rate : -rate) * (1 + k / hold));
    EXPECT_TRUE(wheel.monitor.suspect());
    recovering.push_back(wheel.monitor.recovering());
  }
  return recovering;
}

/// Number of samples from one on with which it is not recovering.
long notRecovering(const std::vector<bool>& recovering, int from) {
  return std::count(recovering.begin() + from, recovering.end(), false);
}

TEST(WheelMonitor, AWheelThatAcceleratesAsASlowOneMayIsOnItsWay) {
  // Half of the limit: 8.4 rad/s^2, 0.168 rad/s per sample, of one that is so far off that nothing else counts.
  for (const double off : {-11.0, 11.0}) {
    EXPECT_EQ(notRecovering(comesBack(off, 0.18, 1, 3), 1), 0) << off;
    EXPECT_EQ(notRecovering(comesBack(off, 0.15, 1, 3), 1), 2) << off;
    EXPECT_EQ(notRecovering(comesBack(off, -0.18, 1, 3), 1), 2) << off << ", goes away";
  }
}

TEST(WheelMonitor, AWheelThatComesSlowlyNearerByATwentiethWithinATenthOfASecondIsOnItsWay) {
  for (const double sign : {1.0, -1.0}) {
    EXPECT_EQ(notRecovering(comesBack(sign * 5.0, 0.06), 6), 0) << "0.25 rad/s in 0.08 s";
    EXPECT_GT(notRecovering(comesBack(sign * 5.0, 0.04), 6), 3) << "0.25 rad/s in 0.14 s";
    EXPECT_GT(notRecovering(comesBack(sign * 5.0, 0.0), 6), 30);
    EXPECT_GT(notRecovering(comesBack(sign * 5.0, -0.06), 6), 30);
  }
}

TEST(WheelMonitor, AWheelAheadOfItsPredictionOnTheWayToItsCommandFollowsIt) {
  for (const double sign : {1.0, -1.0}) {
    Wheel wheel(model(), exactParameters());
    wheel.follow(sign * -8.0, 300);
    wheel.pass(sign * 10.0, 0.04);  // which acts in 0.04 s
    const auto follows = [&wheel](double measurement) {
      WheelMonitor copy = wheel.monitor;
      copy.compare(measurement, 100.0);  // no progress within so long a time
      EXPECT_TRUE(copy.suspect()) << measurement;
      return copy.recovering();
    };
    EXPECT_TRUE(follows(sign * -3.0));
    EXPECT_TRUE(follows(sign * 6.0));
    EXPECT_FALSE(follows(sign * 0.4)) << "it stands";
    EXPECT_FALSE(follows(sign * 11.0)) << "beyond the command";
    EXPECT_FALSE(follows(sign * -10.0)) << "the other way";
  }
}

TEST(WheelMonitor, AHeldValueIsOneMeasurementHoweverOftenItIsPublished) {
  Wheel wheel(model(), exactParameters());
  wheel.follow(10.0, 300);
  for (int k = 0; k < 60; ++k) wheel.look(10.0, 10.0 + 0.5 * (k / 6));  // renewed every 0.12 s
  wheel.monitor.start(10.0);
  wheel.follow(10.0, 100);
  const auto away = [&wheel](int values) {
    Wheel copy = wheel;
    for (int k = 0; k < 6 * values; ++k) copy.pass(10.0, kPeriod).show(k / 6 % 2 == 0 ? 7.0 : 7.2);
    return copy.monitor.state();
  };
  EXPECT_NE(away(2), ChannelState::faulty) << "twelve samples, two measurements";
  EXPECT_EQ(away(6), ChannelState::faulty);
}

TEST(WheelMonitor, TheNoiseOfAFastWheelIsNoneThatASlowOneLacks) {
  // Gear and motor add 5 % of the speed; the encoder counts steps.
  WatchedWheel wheel;
  const auto counted = [&](double speed) { return 0.1 * std::round(speed * (1.0 + 1.5 * wheel.noise()) / 0.1); };
  wheel.drive(10.0, 300, counted);
  EXPECT_EQ(wheel.drive(0.82, 300, counted), 0);
  EXPECT_FALSE(wheel.monitor.frozen());
  wheel.drive(10.0, 100, counted);
  wheel.drive(10.0, 100, [](double) { return 10.1; });
  EXPECT_TRUE(wheel.monitor.frozen()) << "a fast one does";
}

TEST(WheelMonitor, NoiseIsNoComingBack) {
  // Three deviations of the sensor: 0.09 rad/s.
  for (const double sign : {1.0, -1.0}) {
    EXPECT_EQ(notRecovering(comesBack(sign * 1.5, 0.025, 1, 15), 6), 0);
    EXPECT_GT(notRecovering(comesBack(sign * 1.5, 0.0145, 1, 25), 8), 2);
  }
}

TEST(WheelMonitor, AWheelThatStopsComingBackIsNotOnItsWayAnyMore) {
  Wheel wheel(model(), exactParameters());
  wheel.follow(12.0, 300);
  for (int k = 0; k < 10; ++k) wheel.look(12.0, 1.0);
  for (int k = 1; k <= 2; ++k) wheel.look(12.0, 1.0 + 0.2 * k);
  EXPECT_TRUE(wheel.monitor.recovering());
  wheel.look(12.0, 1.4);
  EXPECT_FALSE(wheel.monitor.recovering());
}

TEST(WheelMonitor, AHeldValueIsOnItsWayByTwoRadPerSquareSecond) {
  // Renewed every 0.1 s: 0.2 rad/s from one to the next.
  for (const double off : {-10.5, 10.5}) {
    const auto quick = comesBack(off, 0.24, 5, 15), slow = comesBack(off, 0.16, 5, 15);
    EXPECT_EQ(notRecovering(quick, 5), 0) << off;
    EXPECT_EQ(notRecovering(slow, 5), 10) << off;
  }
}

// Frozen encoders.

/// Whether an encoder that stays while its wheel changes its speed is found. @param quantum steps of it before, 0 for
/// an unknown one.
bool missesMotion(double speed, double change, double quantum) {
  Wheel wheel(model(), exactParameters());
  wheel.keep(speed);
  for (int k = 0; k < (quantum > 0.0 ? 24 : 0); ++k) wheel.look(speed, speed + (k % 2) * quantum);
  bool frozen = false;
  wheel.look(speed, speed);
  for (int k = 0; k < 40; ++k) {
    wheel.look(speed + change, speed);
    frozen |= wheel.monitor.frozen();
  }
  return frozen;
}

TEST(WheelMonitor, ALiveEncoderDoesNotMissThreeOfItsSteps) {
  for (const double sign : {1.0, -1.0}) {
    EXPECT_TRUE(missesMotion(5.0, sign * 0.17, 0.05));
    EXPECT_FALSE(missesMotion(5.0, sign * 0.13, 0.05));
    EXPECT_TRUE(missesMotion(5.0, sign * 0.65, 0.5)) << "coarser than any encoder";
    EXPECT_FALSE(missesMotion(5.0, sign * 0.55, 0.5));
    EXPECT_TRUE(missesMotion(5.0, sign * 0.65, 0.0)) << "as of one that is not known";
    EXPECT_FALSE(missesMotion(5.0, sign * 0.55, 0.0));
  }
}

TEST(WheelMonitor, AFineEncoderDoesNotMissMoreThanADriveTrainDrifts) {
  EXPECT_TRUE(missesMotion(5.0, 0.06, 0.001)) << "a hundredth";
  EXPECT_FALSE(missesMotion(5.0, 0.045, 0.001));
  EXPECT_TRUE(missesMotion(1.5, 0.023, 0.001)) << "and 0.02 rad/s";
  EXPECT_FALSE(missesMotion(1.5, 0.018, 0.001));
}

TEST(WheelMonitor, ChangesBelowAMillionthAreNoNoise) {
  const auto findsFrozen = [](double change) {
    Wheel wheel(model(), exactParameters());
    wheel.monitor.start(5.0);
    double value = 5.0;
    for (int k = 0; k < 200; ++k) {
      value += (k % 40 < 2 ? 0.6 : 1.0) * (k % 2 == 0 ? change : -change);
      wheel.look(5.0, value);
    }
    bool found = false;
    for (int k = 0; k < 100; ++k) {
      wheel.look(5.0, 5.0);
      found |= wheel.monitor.frozen();
    }
    return found;
  };
  EXPECT_TRUE(findsFrozen(2.2e-5));
  EXPECT_FALSE(findsFrozen(0.4e-6));
}

TEST(WheelMonitor, AFrozenEncoderIsFaultyAtOnceAndTakesTheOtherWithIt) {
  Wheel wheel(model(), exactParameters());
  wheel.monitor.start(5.0);
  for (int k = 0; k < 100; ++k) {
    wheel.pass(5.0, kPeriod);
    wheel.show(5.0 + (k % 2 == 0 ? 0.03 : -0.03) + 0.001 * (k % 5));
  }
  Wheel other = wheel;
  for (int k = 0; k < 4; ++k) other.show(5.0);
  other.monitor.freezeWithTheOther();
  EXPECT_FALSE(other.monitor.frozen()) << "too few samples that repeat";
  int samples = 0;
  for (; samples < 30 && wheel.monitor.state() != ChannelState::faulty; ++samples) {
    wheel.pass(5.0, kPeriod);
    wheel.show(5.0);
  }
  EXPECT_TRUE(wheel.monitor.frozen());
  EXPECT_LT(samples, 15);
  WheelMonitor coarse = WheelMonitor(FaultParameters{}, model(), kRadius);
  coarse.start(5.0);
  for (int k = 0; k < 12; ++k) coarse.compare(5.0, kPeriod);
  EXPECT_FALSE(coarse.frozen());
  coarse.freezeWithTheOther();
  EXPECT_TRUE(coarse.frozen() && coarse.suspect());
}

/// A wheel whose command rises at a constant rate, so that there is always a band of the same width.
/// @param noise change of the encoder from sample to sample [rad/s].
Wheel onARamp(double noise) {
  FaultParameters p;
  p.gain_deviation = 0.0;
  Wheel wheel(model(), p);
  wheel.follow(2.0, 300);
  for (int k = 0; k < 300; ++k) {
    wheel.pass(2.0 + 0.03 * k, kPeriod);
    wheel.show(wheel.monitor.speed() + (k % 2 == 0 ? 0.5 : -0.5) * noise);
  }
  return wheel;
}

TEST(WheelMonitor, WhereItMayBeAnywhereWithinThreeDeviationsNoNoiseIsLearned) {
  Wheel wheel(model(), [] {
    FaultParameters p;
    p.gain_deviation = 0.0;
    return p;
  }());
  wheel.monitor.start(0.0);
  double command = 0.0;
  for (int k = 0; k < 400; ++k) {  // from the start, while the noise is unknown
    wheel.pass(command += 0.03, kPeriod);
    wheel.show(wheel.monitor.speed());
  }
  wheel.pass(command, kPeriod);
  const double speed = wheel.monitor.speed(), high = wheel.edge(speed, 1.0), width = high - wheel.edge(speed, -1.0);
  EXPECT_NEAR(wheel.distanceOf(high + 1.0), 1.0 / (5.0 * width / 3.0), 0.25 / (5.0 * width / 3.0));
}

TEST(WheelMonitor, AQuarterOfTheBandIsMotionAndNoNoise) {
  const auto findsFrozen = [](double noise) {
    Wheel wheel = onARamp(noise);
    bool found = false;
    for (int k = 0; k < 160; ++k) {  // the command stays, and so does the speed before long
      wheel.follow(10.97, 1);
      found |= wheel.monitor.frozen();
    }
    return found;
  };
  const Wheel wheel = onARamp(0.0);
  const double speed = wheel.monitor.speed(), width = wheel.edge(speed, 1.0) - wheel.edge(speed, -1.0);
  // The ramp itself adds 0.03 rad/s, an eighth of the band, to every second change.
  EXPECT_TRUE(findsFrozen(0.5 * width));
  EXPECT_FALSE(findsFrozen(0.2 * width)) << "to and fro by half of it";
}

TEST(WheelMonitor, AnAcceleratingWheelIsCorrectedAsFarAsItsDeadTimeIsKnown) {
  const auto correction = [](double deviation) {
    FaultParameters p = exactParameters();
    p.dead_time_deviation = deviation;
    Wheel wheel(model(), p);
    wheel.follow(0.0, 300);
    wheel.follow(10.0, 15);
    wheel.pass(10.0, kPeriod);
    const double before = wheel.monitor.speed();
    wheel.show(before + 0.1);
    return (wheel.monitor.speed() - before) / 0.1;
  };
  EXPECT_GT(correction(0.0), 0.1);
  EXPECT_LT(correction(0.05), 0.02);
}

TEST(WheelMonitor, TheBandMovesWithWhatIsBelieved) {
  for (const double off : {0.2, -0.2}) {
    Wheel wheel;
    ReachableSpeeds reachable(model(), kRadius, {0.09, 0.09, 0.01, 0.01, 0.5, 3.0});
    const auto pass = [&](double command, double duration) {
      wheel.pass(command, duration);
      predict(reachable, command, std::lround(duration / 0.001));
    };
    for (int k = 0; k < 600; ++k) {
      pass(10.0, kPeriod);
      wheel.show(k < 100 ? wheel.monitor.speed() : 10.0 + off);
    }
    for (const double command : {2.0, 15.0}) {
      for (int k = 0; k < 15; ++k) {
        pass(command, kPeriod);
        const double speed = wheel.monitor.speed(), offset = speed - reachable.nominal();
        ASSERT_NEAR(wheel.edge(speed, -1.0), reachable.low() + offset, 0.1) << off << ", " << command << ", " << k;
        ASSERT_NEAR(wheel.edge(speed, 1.0), reachable.high() + offset, 0.1) << off << ", " << command << ", " << k;
      }
    }
  }
}

TEST(WheelMonitor, AStartForgetsHowFarItWasOff) {
  Wheel wheel(model(), exactParameters());
  wheel.keep(8.0);
  for (int k = 0; k < 3; ++k) wheel.show(0.0);
  wheel.monitor.start(5.0);
  wheel.look(5.0, 3.0);
  EXPECT_TRUE(wheel.monitor.suspect());
  EXPECT_FALSE(wheel.monitor.recovering());
}

TEST(WheelMonitor, HowFastAWheelOnItsWayIsDependsOnTheSlowestDriveTrain) {
  const auto isOnItsWay = [](double rate) {
    FaultParameters slow = exactParameters();
    slow.slowest_acceleration = 0.5;
    Wheel wheel(model(), slow);
    wheel.keep(12.0);
    for (int k = 0; k < 10; ++k) wheel.look(12.0, 1.0);
    wheel.look(12.0, 1.0 + rate);
    wheel.look(12.0, 1.0 + 2.0 * rate);
    return wheel.monitor.recovering();
  };
  EXPECT_TRUE(isOnItsWay(0.095)) << "4.2 rad/s^2";
  EXPECT_FALSE(isOnItsWay(0.075));
}

}  // namespace
}  // namespace jackal_aic
