#include "jackal_aic/faults/wheel_monitor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "watched_robot.hpp"

namespace jackal_aic {
namespace {

/// A monitor that is shown what a test says. Without noise its distances are those of the formulas of the headers.
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

  /// Shows a speed now, once or some times.
  void show(double measurement, int times = 1) {
    for (; times > 0; --times) {
      monitor.compare(measurement, kPeriod);
      monitor.conclude(measurement, kPeriod);
    }
  }

  /// The distance that a speed would have now. No time passes, so that it is no jump.
  double distanceOf(double measurement) const {
    WheelMonitor copy = monitor;
    copy.compare(measurement, 0.0);
    return copy.distance();
  }

  /// Where the band of speeds ends that need no noise to be explained. @param way 1 or -1.
  double edge(double inside, double way) const {
    double in = inside, out = inside + 40.0 * way;
    for (int k = 0; k < 60; ++k) (distanceOf(0.5 * (in + out)) == 0.0 ? in : out) = 0.5 * (in + out);
    return in;
  }

  /// Expects these ends of the band.
  void expectBand(double low, double high, double tolerance) const {
    EXPECT_NEAR(edge(monitor.speed(), -1.0), low, tolerance);
    EXPECT_NEAR(edge(monitor.speed(), 1.0), high, tolerance);
  }

  WheelMonitor monitor;
};

/// A monitor that watches a wheel with noise.
class WatchedWheel : public Wheel {
 public:
  explicit WatchedWheel(const PlantModel& real = model(), const PlantModel& told = model())
      : Wheel(told), wheel_(real, kRadius, {}) {}

  /// Drives for some samples; returns how many of them did not count. @param measured makes of the true speed
  /// [rad/s] what the encoder says.
  template <class Measured>
  int drive(double command, int samples, Measured measured) {
    int left_out = 0;
    for (int i = 0; i < samples; ++i) {
      pass(command, kPeriod);
      for (int k = 0; k < 20; ++k) wheel_.predict(command);
      show(measured(wheel_.speed()));
      left_out += monitor.state() == ChannelState::ok ? 0 : 1;
    }
    return left_out;
  }

  int drive(double command, int samples) {
    return drive(command, samples, [this](double speed) { return speed + noise(); });
  }

  double noise() { return 0.03 * normal_(random_); }

 private:
  WheelBelief wheel_;
  std::mt19937 random_{3};
  std::normal_distribution<double> normal_{0.0, 1.0};
};

// ---- what is no fault

TEST(WheelMonitor, AWheelThatIsEarlierOrLaterThanItsModelIsNoFault) {
  for (const double dead_time : {0.01, 0.04, 0.12, 0.16}) {
    WatchedWheel wheel(changed(model(), [=](PlantModel& m) { m.dead_time = dead_time; }));
    for (const double command : {5.0, -5.0, 10.0, 0.0, -8.0, 8.0, 0.0}) {
      EXPECT_EQ(wheel.drive(command, 75), 0) << dead_time;
    }
  }
  WatchedWheel soft(changed(model(), [](PlantModel& m) { m.lag = 0.25; }), assumedModel());
  for (const double command : {3.0, -3.0, 5.0, 0.0}) EXPECT_EQ(soft.drive(command, 100), 0) << "of a robot assumed";
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

/// Stiction: a wheel that stands starts at 0.75 rad/s, and one that turns goes on down to rest.
TEST(WheelMonitor, AWheelThatSticksAtASmallCommandAndThenStartsIsNoFault) {
  for (const double sign : {1.0, -1.0}) {
    WatchedWheel wheel;
    bool stands = true;
    const auto coarse = [&](double speed) {
      stands = stands ? std::abs(speed) < 0.75 : std::abs(speed) < 0.02;
      return stands ? 0.0 : 0.06 * std::round((speed + wheel.noise()) / 0.06);
    };
    wheel.drive(3.0 * sign, 100, coarse);
    for (int k = 0; k < 100; ++k) EXPECT_EQ(wheel.drive(sign * (0.2 - 0.01 * k), 1, coarse), 0);  // to the other side
    for (int k = 0; k < 100; ++k) EXPECT_EQ(wheel.drive(sign * (-0.8 + 0.01 * k), 1, coarse), 0);
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
    const auto look = [&](double share) {
      return wheel.drive(share * kCommand, 1, [&](double) { return share * dragged + wheel.noise(); });
    };
    for (int k = 0; k < kRamp; ++k)
      EXPECT_EQ(look(static_cast<double>(k) / kRamp), 0) << dragged << ", led away slowly";
    for (int k = 0; k < 50; ++k) look(1.0);
    EXPECT_EQ(wheel.monitor.state(), dragged == 0.0 ? ChannelState::faulty : ChannelState::ok) << dragged;
  }
}

// ---- the band of speeds that may be

TEST(WheelMonitor, TheBandIsThatOfARangeOfDriveTrains) {
  const struct {
    const char* name;
    double dead_time, lag;
    bool identified;
    DriveTrainRange range;
    double gain, offset;
  } rows[] = {
      {"three deviations of its timing", 0.08, 0.01, true, {0.09, 0.09, 0.01, 0.01, 0.5, 3.0}, 0.0, 0.0},
      {"of a lag beyond that of motors the sum is known", 0.2, 0.3, true, {0.19, 0.19, 0.2, 0.5, 0.5, 3.0}, 0.0, 0.0},
      {"half and double of what is assumed", 0.2, 0.03, false, {0.19, 0.29, 0.015, 0.36, 0.5, 3.0}, 0.25, 0.5}};
  for (const auto& row : rows) {
    const PlantModel told = changed(
        model(), [&](PlantModel& m) { m.dead_time = row.dead_time, m.lag = row.lag, m.identified = row.identified; });
    Wheel wheel(told);
    ReachableSpeeds reachable(told, kRadius, row.range);
    for (const double command : {10.0, -10.0, 3.0}) {
      for (int k = 1; k <= 50; ++k) {
        wheel.pass(command, kPeriod);
        for (int i = 0; i < 20; ++i) reachable.predict(command);
        double low = reachable.speeds().low, high = reachable.speeds().high;
        if (low <= 0.8 && high >= -0.8) low = std::min(low, 0.0), high = std::max(high, 0.0);  // stiction
        low = std::min(low, reachable.speeds().low - row.gain * std::abs(reachable.speeds().low) - row.offset);
        high = std::max(high, reachable.speeds().high + row.gain * std::abs(reachable.speeds().high) + row.offset);
        SCOPED_TRACE(testing::Message() << row.name << ": " << command << ", " << k);
        wheel.expectBand(low, high, 1e-4);
        if (HasFailure()) return;
      }
    }
  }
}

TEST(WheelMonitor, StartsAtItsSpeedAndWithNoFault) {
  for (const double speed : {5.0, -3.0, 0.0}) {
    Wheel wheel;
    wheel.follow(8.0, 100);
    wheel.show(0.0, 10);
    ASSERT_EQ(wheel.monitor.state(), ChannelState::faulty);
    if (speed == 0.0) wheel.monitor.forget();
    if (speed != 0.0) wheel.monitor.start(speed);
    EXPECT_EQ(wheel.monitor.state(), ChannelState::ok);
    EXPECT_FALSE(wheel.monitor.suspect() || wheel.monitor.frozen() || wheel.monitor.recovering());
    EXPECT_FALSE(wheel.monitor.suspecting());
    EXPECT_NEAR(wheel.monitor.speed(), speed, 1e-12);
    for (int k = 0; k < 20; ++k) {  // with the command that has been driving it for long
      wheel.pass(speed, kPeriod);
      ASSERT_NEAR(wheel.monitor.speed(), speed, 1e-9);
      wheel.expectBand(speed, speed, 1e-6);
      ASSERT_LT(wheel.monitor.turns(false).variance, 0.1);
    }
  }
  Wheel off(model(), exactParameters());
  off.keep(8.0).show(0.0, 3);
  off.monitor.start(5.0);
  off.look(5.0, 3.0);
  EXPECT_TRUE(off.monitor.suspect() && !off.monitor.recovering()) << "a start forgets how far it was off";
}

TEST(WheelMonitor, StartsUnderWayWithTheCommandsBefore) {
  Wheel wheel(model(), exactParameters());
  wheel.show(7.0, 10);
  ASSERT_EQ(wheel.monitor.state(), ChannelState::faulty);
  wheel.pass(9.0, 0.3);
  wheel.monitor.start(3.0, true);
  EXPECT_NEAR(wheel.monitor.speed(), 3.0, 1e-12);
  wheel.pass(9.0, 0.1);
  const double expected = 3.0 + 0.1 * 1.65 / kRadius;  // at the acceleration limit
  EXPECT_NEAR(wheel.monitor.speed(), expected, 0.01);
  wheel.expectBand(expected, expected, 0.01);
  EXPECT_EQ(wheel.monitor.state(), ChannelState::ok);
  for (const double off : {0.1, -0.1}) {
    wheel.monitor.compare(expected + off, kPeriod);
    EXPECT_EQ(wheel.monitor.fasterThanCommanded(), off > 0.0);
  }
}

// ---- variances

TEST(WheelMonitor, TheVarianceIsThatOfNoiseAndResolutionAndGrowsWithoutMeasurements) {
  const auto variance = [](double noise, double step, double unmeasured) {
    Wheel wheel(model(), changed(exactParameters(), [=](FaultParameters& p) { p.wheel_variance = noise; }));
    wheel.keep(5.0);
    for (int k = 0; k < 20; ++k) wheel.look(5.0, 5.0 + (k % 2) * step);
    wheel.pass(5.0, unmeasured);
    return wheel.monitor.turns(false).variance;
  };
  const double fine = variance(9e-4, 1e-4, 0.0);
  EXPECT_LT(fine, 5e-3);
  EXPECT_NEAR(variance(9e-4, 0.1, 0.0) - fine, 0.1 * 0.1 / 12.0, 1e-6) << "which does not average out";
  EXPECT_NEAR(variance(9e-4, 0.5, 0.0) - fine, 0.2 * 0.2 / 12.0, 1e-6) << "coarser than any encoder";
  EXPECT_GT(variance(0.09, 1e-4, 0.0), 1.5 * fine);
  EXPECT_NEAR(variance(9e-4, 1e-4, 600.0), 0.3 * 0.3, 1e-6) << "up to a limit";
}

TEST(WheelMonitor, AGainThatIsNotTheModelsMakesAChangeOfTheSpeedUncertain) {
  Wheel wheel(model(), exactParameters());
  wheel.follow(0.0, 400);
  wheel.follow(10.0, 36);  // it has just arrived
  const double limit = 1.65 / kRadius, time = 10.0 / limit;
  ASSERT_NEAR(wheel.monitor.speed(), 10.0, 0.3);
  wheel.pass(10.0, kPeriod);
  const double since = 37 * kPeriod - model().dead_time - time;
  const double change = 0.1 * limit * 0.5 * (1.0 - std::exp(-time / 0.5)) * std::exp(-since / 0.5);
  const double deviation = std::sqrt(wheel.monitor.turns(false).variance + 9e-4 + change * change);
  EXPECT_NEAR(wheel.distanceOf(wheel.monitor.speed() + 3.0), 3.0 / (5.0 * deviation), 0.03);
}

/// The band widens by three times the root mean square of what lasts, noise apart, less 0.3 rad/s.
TEST(WheelMonitor, WhatAModelIsUsuallyOffByIsNoFault) {
  Wheel wheel(model(), exactParameters());
  wheel.follow(10.0, 300);
  double speed = 10.0;
  for (; speed > 8.0; speed -= 0.01) wheel.pass(10.0, kPeriod).show(speed);  // slower and slower
  for (int k = 0; k < 60 * kSecond; ++k) wheel.pass(10.0, kPeriod).show(speed);
  EXPECT_EQ(wheel.monitor.state(), ChannelState::ok);
  wheel.pass(10.0, kPeriod);
  const double believed = wheel.monitor.speed(), wider = 3.0 * (2.0 - 3.0 * std::sqrt(2e-3)) - 0.3;
  EXPECT_NEAR(believed, speed, 0.05);
  wheel.expectBand(believed - wider, believed + wider, 0.15);
}

// ---- encoders that hold their value

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
  const struct {
    const char* why;
    double quantum, change;  // of the encoder, 0: unknown
    bool learned;
  } rows[] = {{"of an unknown resolution", 0.0, 0.15, true}, {"too small", 0.0, 0.08, false},
              {"more than three steps", 0.1, 0.4, true},     {"two and a half steps", 0.1, 0.25, false},
              {"coarser than any encoder", 0.5, 0.7, true},  {"too small", 0.01, 0.08, false}};
  for (const auto& row : rows) {
    std::vector<double> changes;  // its resolution first, to and fro
    for (int k = 0; k < (row.quantum > 0.0 ? 12 : 0); ++k) changes.push_back(k % 2 == 0 ? row.quantum : -row.quantum);
    changes.insert(changes.end(), 8, row.change);
    EXPECT_EQ(heldMotion(changes, 5) > 0.7, row.learned) << row.why;
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

// ---- wheels that come back

TEST(WheelMonitor, AWheelThatComesNearerInTimeIsOnItsWay) {
  constexpr double kSpeed = 12.0, kOff = 10.5;  // rad/s
  const struct {
    const char* why;
    double rate;  // per value, towards the prediction [rad/s]
    int hold;     // samples for which the encoder holds a value
    bool recovers;
  } rows[] = {{"half of the limit, 8.4 rad/s^2", 0.18, 1, true},
              {"slower", 0.15, 1, false},
              {"2.4 rad/s^2 of values that are held for 0.1 s", 0.24, 5, true},
              {"1.6 rad/s^2", 0.16, 5, false}};
  for (const auto& row : rows) {
    for (const double sign : {1.0, -1.0}) {
      Wheel wheel(model(), exactParameters());
      wheel.follow(kSpeed, 300);
      for (int k = 0; k < (row.hold > 1 ? 8 * row.hold : 0); ++k) wheel.look(kSpeed, kSpeed + 0.5 * (k / row.hold));
      if (row.hold > 1) wheel.look(kSpeed, kSpeed);
      for (int k = 0; k < 10; ++k) wheel.look(kSpeed, kSpeed + sign * kOff);
      EXPECT_FALSE(wheel.monitor.recovering()) << row.why;
      for (int k = 0; k < 3 * row.hold; ++k) {
        wheel.look(kSpeed, kSpeed + sign * (kOff - row.rate * (1 + k / row.hold)));
        EXPECT_TRUE(k < row.hold || wheel.monitor.recovering() == row.recovers) << row.why << ", " << k;
      }
    }
  }
}

TEST(WheelMonitor, AWheelAheadOfItsPredictionOnTheWayToItsCommandFollowsIt) {
  for (const double sign : {1.0, -1.0}) {
    Wheel wheel(model(), exactParameters());
    wheel.follow(sign * -8.0, 300);
    wheel.pass(sign * 10.0, 0.04);  // which acts in 0.04 s
    const auto follows = [&](double measurement) {
      WheelMonitor copy = wheel.monitor;
      copy.compare(sign * measurement, 100.0);  // no progress within so long a time
      EXPECT_TRUE(copy.suspect()) << measurement;
      return copy.recovering();
    };
    EXPECT_TRUE(follows(-3.0));
    EXPECT_TRUE(follows(6.0));
    EXPECT_FALSE(follows(0.4)) << "it stands";
    EXPECT_FALSE(follows(11.0)) << "beyond the command";
    EXPECT_FALSE(follows(-10.0)) << "the other way";
  }
}

// ---- jumps

/// An assumed model may be off by a quarter, but no wheel takes on another speed from one sample to the next.
TEST(WheelMonitor, AnAssumedWheelThatJumpsIsNoOtherDriveTrain) {
  const struct {
    const char* why;
    double measured;  // of 2.3 rad/s
    int samples;      // on its way
    bool suspect;
  } rows[] = {{"jumps to half", 1.15, 1, true},
              {"jumps up", 3.4, 1, true},
              {"is slowed down by a load", 1.5, 5, false},
              {"within noise and load", 2.0, 1, false}};
  for (const auto& row : rows) {
    for (const double sign : {1.0, -1.0}) {
      Wheel wheel(assumedModel());
      wheel.keep(sign * 2.3);
      double measured = 2.3;
      for (int k = 0; k < 10; ++k) {
        if (k < row.samples) measured += (row.measured - 2.3) / row.samples;
        wheel.look(sign * 2.3, sign * measured);
        if (k >= row.samples) EXPECT_EQ(wheel.monitor.suspect(), row.suspect) << row.why << ", " << k;
      }
      wheel.look(sign * 2.3, sign * 2.3);
      EXPECT_FALSE(wheel.monitor.suspect()) << row.why << ": it is back";
    }
  }
}

// ---- frozen encoders

TEST(WheelMonitor, ALiveEncoderDoesNotMissMotion) {
  const struct {
    const char* why;
    double speed, quantum, alive, missed;  // rad/s; its steps before, 0: unknown; changes that it may miss and not
  } rows[] = {{"three steps", 5.0, 0.05, 0.13, 0.17},
              {"coarser than any encoder", 5.0, 0.5, 0.55, 0.65},
              {"as of the coarsest", 5.0, 0.0, 0.55, 0.65},
              {"a hundredth, drift", 5.0, 0.001, 0.045, 0.06},
              {"0.02 rad/s, drift", 1.5, 0.001, 0.018, 0.023}};
  for (const auto& row : rows) {
    for (const double change : {row.alive, -row.alive, row.missed, -row.missed}) {
      Wheel wheel(model(), exactParameters());
      wheel.keep(row.speed);
      for (int k = 0; k < (row.quantum > 0.0 ? 24 : 0); ++k) wheel.look(row.speed, row.speed + (k % 2) * row.quantum);
      bool frozen = false;
      wheel.look(row.speed, row.speed);
      for (int k = 0; k < 40; ++k) {
        wheel.look(row.speed + change, row.speed);
        frozen |= wheel.monitor.frozen();
      }
      EXPECT_EQ(frozen, std::abs(change) == row.missed) << row.why << ": " << change << " of " << row.speed;
    }
  }
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

TEST(WheelMonitor, AFrozenEncoderIsFaultyAtOnce) {
  Wheel wheel(model(), exactParameters());
  wheel.monitor.start(5.0);
  for (int k = 0; k < 100; ++k) wheel.pass(5.0, kPeriod).show(5.0 + (k % 2 == 0 ? 0.03 : -0.03) + 0.001 * (k % 5));
  Wheel other = wheel;
  other.show(5.0, 4);
  other.monitor.freezeWithTheOther();
  EXPECT_FALSE(other.monitor.frozen()) << "too few samples that repeat";
  int samples = 0;
  for (; samples < 30 && wheel.monitor.state() != ChannelState::faulty; ++samples) wheel.pass(5.0, kPeriod).show(5.0);
  EXPECT_TRUE(wheel.monitor.frozen());
  EXPECT_LT(samples, 15);
}

/// The command rises at a constant rate, so that there is always a band of the same width.
TEST(WheelMonitor, AQuarterOfTheBandIsMotionAndNoNoise) {
  const auto on_a_ramp = [](double noise) {  // change of the encoder from sample to sample [rad/s]
    Wheel wheel(model(), changed(FaultParameters{}, [](FaultParameters& p) { p.gain_deviation = 0.0; }));
    wheel.follow(2.0, 300);
    for (int k = 0; k < 300; ++k) {
      wheel.pass(2.0 + 0.03 * k, kPeriod);
      wheel.show(wheel.monitor.speed() + (k % 2 == 0 ? 0.5 : -0.5) * noise);
    }
    return wheel;
  };
  const Wheel quiet = on_a_ramp(0.0);
  const double speed = quiet.monitor.speed(), width = quiet.edge(speed, 1.0) - quiet.edge(speed, -1.0);
  // The ramp itself adds 0.03 rad/s, an eighth of the band, to every second change.
  for (const auto& [share, found] : {std::pair(0.5, true), {0.2, false}}) {
    Wheel wheel = on_a_ramp(share * width);
    bool frozen = false;
    for (int k = 0; k < 160; ++k) frozen |= wheel.follow(10.97, 1).monitor.frozen();  // the command stays
    EXPECT_EQ(frozen, found) << share;
  }
}

}  // namespace
}  // namespace jackal_aic
