#include "jackal_aic/faults/yaw_monitor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "jackal_aic/model/square.hpp"

namespace jackal_aic {
namespace {

constexpr double kTrack = 0.55;   // m
constexpr double kPeriod = 0.02;  // s
const SampleStep kStep(kPeriod, FaultParameters{}.covariance_time_constant);
constexpr double kSpread = 2e-6;  // variance of the difference speed [(m/s)^2]
constexpr double kBound = 5.0;    // sqrt(1 / 0.04)
constexpr ChannelState kOk = ChannelState::ok, kOutlier = ChannelState::outlier, kFaulty = ChannelState::faulty;

/// A gyro without noise, whose driver adds none: every distance is known from the formulas of the headers.
class Gyro {
 public:
  explicit Gyro(const FaultParameters& parameters = {}) : monitor(parameters, kTrack) {}

  /// A yaw rate that the wheels ask for [rad/s]. @param x their difference speed [m/s].
  static double asked(double x) { return x / kTrack; }

  /// Shows samples, with the motion as it is. @returns the state with the last one.
  ChannelState show(double yaw_rate, int samples = 1) {
    for (int k = 0; k < samples; ++k) {
      pass(kPeriod);
      monitor.check(yaw_rate, {x, kSpread, forward}, true, kStep, shock);
    }
    return monitor.state();
  }

  /// A turn that is not new to the monitor, in which the gyro reads what it should and a bias.
  Gyro& settle(double difference, double bias = 0.0, int samples = 400) {
    x = 0.0;
    show(bias, samples);
    x = difference;
    show(asked(x) + bias, samples);
    return *this;
  }

  /// Lets time pass with the rates as they are [s].
  void pass(double duration) {
    for (long k = std::lround(duration / 0.001); k > 0; --k) monitor.predict(forward_rate, difference_rate, 0.001);
  }

  /// Samples that are shown until the state changes, up to a limit.
  int samplesUntil(ChannelState state, double yaw_rate, int limit) {
    int samples = 1;
    while (show(yaw_rate) != state && samples < limit) ++samples;
    return samples;
  }

  double slopeVariance() const { return monitor.belief().variance(1.0, 0.0) - monitor.belief().variance(0.0, 0.0); }

  YawMonitor monitor;
  double x = 0.0, forward = 0.0;                     // of the wheels [m/s]
  double forward_rate = 0.0, difference_rate = 0.0;  // of the wheels [m/s^2]
  Shock shock;
};

TEST(YawMonitor, BeginsWithItsParameters) {
  FaultParameters parameters;
  parameters.gyro_variance = 1e-4;
  parameters.largest_bias = 0.06;
  const Gyro gyro(parameters);
  EXPECT_DOUBLE_EQ(gyro.monitor.belief().variance(0.0, 0.0), square(0.03) + 1e-4);
}

TEST(YawMonitor, AChangeOfTheMotionMakesTheSlipUncertainForHalfASecond) {
  for (const bool turns : {true, false}) {
    Gyro gyro;
    gyro.settle(0.5);
    const double before = gyro.slopeVariance();
    (turns ? gyro.difference_rate : gyro.forward_rate) = 250.0;
    gyro.pass(0.001);
    gyro.difference_rate = gyro.forward_rate = 0.0;
    const double all = 0.5 * square(0.2 / kTrack * 0.5);  // by a change of 0.25 m/s, half of YawBelief::kMotionScale
    const double drift = square(0.05 / kTrack);           // in a second
    gyro.pass(0.25);
    EXPECT_NEAR(gyro.slopeVariance() - before, all * (1.0 - std::exp(-1.0)) + 0.25 * drift, 0.02 * all) << turns;
    gyro.pass(1.75);
    EXPECT_NEAR(gyro.slopeVariance() - before, all + 2.0 * drift, 0.02 * all) << turns;
  }
}

TEST(YawMonitor, BothChangesOfTheMotionCount) {
  Gyro gyro;
  gyro.settle(0.5);
  const double before = gyro.slopeVariance();
  gyro.difference_rate = 150.0;
  gyro.forward_rate = -100.0;
  gyro.pass(0.001);
  gyro.difference_rate = gyro.forward_rate = 0.0;
  gyro.pass(2.0);
  const double all = 0.5 * square(0.2 / kTrack * 0.5);
  EXPECT_NEAR(gyro.slopeVariance() - before, all + 2.0 * square(0.05 / kTrack), 0.02 * all);
}

TEST(YawMonitor, UnlikeTyresMakeTheBiasUncertainByAHundredthOfTheChangeOfSpeed) {
  Gyro gyro;
  gyro.settle(0.5);
  const double before = gyro.monitor.belief().biasVariance();
  gyro.forward_rate = 800.0;
  gyro.pass(0.001);
  gyro.forward_rate = 0.0;
  gyro.pass(2.0);
  const double all = 0.5 * square(0.01 / kTrack * 0.8);
  EXPECT_NEAR(gyro.monitor.belief().biasVariance() - before, all + 2e-6, 0.02 * all);
}

TEST(YawMonitor, AnAccelerationTakesGripAndATurnThatBeginsComesLate) {
  const auto extra = [](double forward_rate, double difference_rate) {  // variance in addition to the belief's
    Gyro gyro;
    gyro.settle(0.5);
    gyro.forward_rate = forward_rate;
    gyro.difference_rate = difference_rate;
    gyro.pass(0.6 - kPeriod);
    const double yaw_rate = Gyro::asked(gyro.x) + 0.3;
    YawMonitor before = gyro.monitor;
    for (int k = 0; k < 20; ++k) before.predict(forward_rate, difference_rate, 0.001);
    const double error = before.belief().error(yaw_rate, gyro.x), variance = before.belief().variance(gyro.x, kSpread);
    gyro.show(yaw_rate);
    return square(error / (kBound * gyro.monitor.distance())) - variance;
  };
  EXPECT_NEAR(extra(0.0, 0.0), 0.0, 1e-6);
  const double grip = square(0.2 / kTrack * 0.5 * 0.05 / 0.1);  // 1 m/s^2 for 0.05 s, by 0.1 m/s
  EXPECT_NEAR(extra(1.0, 0.0), grip, 0.05 * grip);
  const double late = square(0.05 / kTrack);  // 1 m/s^2 for the delay of 0.05 s
  EXPECT_NEAR(extra(0.0, 1.0), late, 0.05 * late);
}

TEST(YawMonitor, TheBiasIsLearnedOnceTheMotionHasSettledForAFifthOfASecond) {
  const auto learnsAfter = [](double time) {
    Gyro gyro;
    gyro.difference_rate = 30.0;
    gyro.pass(0.001);  // 0.03 m/s, which fades below 0.02 within 0.2 s
    gyro.difference_rate = 0.0;
    gyro.pass(0.203 + time - kPeriod);
    gyro.show(0.02);
    return gyro.monitor.belief().bias() > 0.0;
  };
  EXPECT_FALSE(learnsAfter(0.15));
  EXPECT_TRUE(learnsAfter(0.25));
}

TEST(YawMonitor, ASlowChangeOfTheMotionIsNone) {
  const auto learnsWith = [](double rate) {
    Gyro gyro;
    gyro.forward_rate = rate;
    gyro.pass(5.0);
    gyro.show(0.02);
    return gyro.monitor.belief().bias() > 0.0;
  };
  EXPECT_TRUE(learnsWith(0.03)) << "0.015 m/s within the half second";
  EXPECT_FALSE(learnsWith(0.05));
}

/// The state with a sample that reads less of a turn than the one before. @param less [rad/s].
ChannelState afterADrop(double x, double less) {
  Gyro gyro;
  gyro.settle(x);
  return gyro.show(Gyro::asked(x) - less);
}

TEST(YawMonitor, ABodyChangesItsTurnByFourRadPerSquareSecondOrMoreInAFastTurn) {
  // 0.02 s of it, and five deviations of the noise, 0.005 rad/s.
  EXPECT_EQ(afterADrop(0.2, 0.100), kOk);
  EXPECT_EQ(afterADrop(0.2, 0.110), kOutlier);
  const double fast = 8.0 * Gyro::asked(0.5) * kPeriod + 0.025;
  EXPECT_EQ(afterADrop(0.5, 0.97 * fast), kOk);
  EXPECT_EQ(afterADrop(0.5, 1.03 * fast), kOutlier);
}

TEST(YawMonitor, AJumpLastsUntilTheDistanceIsWellBelowTheBound) {
  const auto afterAJumpTo = [](double distance) {
    Gyro gyro;
    gyro.settle(0.5);
    EXPECT_EQ(gyro.show(Gyro::asked(0.5) - 0.3), kOutlier);
    gyro.pass(kPeriod);
    const double error = distance * kBound * std::sqrt(gyro.monitor.belief().variance(0.5, kSpread));
    gyro.monitor.check(Gyro::asked(0.5) - error, {0.5, kSpread, 0.0}, true, kStep);
    EXPECT_NEAR(gyro.monitor.distance(), distance, 0.01);
    return gyro.monitor.state();
  };
  EXPECT_EQ(afterAJumpTo(0.6), kOk);
  EXPECT_EQ(afterAJumpTo(0.9), kOutlier);
  EXPECT_EQ(afterAJumpTo(1.2), kOutlier);
}

/// A gyro that has seen jolts of the ground, and goes on straight or in a turn.
Gyro jolted(int jolts, double x) {
  Gyro gyro;
  gyro.settle(x);
  for (int k = 0; k < jolts; ++k) {
    gyro.show(0.6 * Gyro::asked(x));
    gyro.show(Gyro::asked(x), 10);
  }
  return gyro;
}

TEST(YawMonitor, EveryJoltThatEndedLetsTheNextOneLastAQuarterOfASecondLonger) {
  const auto toleratedFor = [](int jolts, double wait) {  // [s]
    Gyro gyro = jolted(jolts, 0.5);
    for (double t = 0.0; t < wait; t += 0.5)
      gyro.monitor.check(Gyro::asked(0.5), {0.5, kSpread, 0.0}, true,
                         {0.5, FaultParameters{}.covariance_time_constant});
    return kPeriod * (gyro.samplesUntil(kOutlier, 0.6 * Gyro::asked(0.5), 200) - 1);
  };
  EXPECT_EQ(toleratedFor(0, 0.0), 0.0);
  EXPECT_NEAR(toleratedFor(1, 0.0), 0.25, 0.021);
  EXPECT_NEAR(toleratedFor(2, 0.0), 0.5, 0.021);
  EXPECT_NEAR(toleratedFor(8, 0.0), 1.0, 0.021) << "at most";
  EXPECT_NEAR(toleratedFor(2, 600.0), 0.5 * std::exp(-1.0), 0.021) << "those of ten minutes ago count less";
}

TEST(YawMonitor, ARobotThatRocksTurnsByUpToSixTenthsOff) {
  for (const double x : {0.3, 1.0}) {
    for (const double sign : {1.0, -1.0}) {
      EXPECT_EQ(jolted(4, x).show((1.0 + 0.57 * sign) * Gyro::asked(x)), kOk) << x;
      EXPECT_EQ(jolted(4, x).show((1.0 + 0.63 * sign) * Gyro::asked(x)), kOutlier) << x;
    }
  }
}

/// The state after a yaw rate that has gone from what the wheels ask for to a part of it, as fast as a body can.
ChannelState afterGoingTo(double part, double x) {
  Gyro gyro;
  gyro.settle(x);
  const int samples = static_cast<int>(std::ceil(std::abs(part - 1.0) / 0.16));
  for (int k = 1; k <= samples; ++k) gyro.show((1.0 + (part - 1.0) * k / samples) * Gyro::asked(x));
  return gyro.monitor.state();
}

TEST(YawMonitor, ATurnMaySlideAwayOrTurnFasterOnAnotherGround) {
  for (const double x : {0.3, 1.0, -1.0}) {
    EXPECT_EQ(afterGoingTo(-0.1, x), kOk) << "0.15 against the wheels at most";
    EXPECT_NE(afterGoingTo(-0.2, x), kOk);
    EXPECT_EQ(afterGoingTo(1.42, x), kOk) << "0.45 more at most";
    EXPECT_NE(afterGoingTo(1.48, x), kOk);
  }
}

TEST(YawMonitor, RestartingForgetsJoltsAndWaitsForTheMotionToSettle) {
  Gyro gyro = jolted(4, 0.5);
  gyro.show(0.6 * Gyro::asked(0.5));
  gyro.monitor.restart();
  const double error = 0.9 * kBound * std::sqrt(gyro.monitor.belief().variance(0.5, kSpread));
  EXPECT_EQ(gyro.show(Gyro::asked(0.5) - error), kOk) << "it is not in a jump";
  gyro.show(Gyro::asked(0.5), 10);
  EXPECT_EQ(gyro.show(0.6 * Gyro::asked(0.5)), kOutlier) << "the next one is the first";
  const double bias = gyro.monitor.belief().bias();
  gyro.monitor.restart();
  gyro.x = 0.0;
  gyro.show(0.01, 9);
  EXPECT_EQ(gyro.monitor.belief().bias(), bias);
  gyro.show(0.01, 9);
  EXPECT_NE(gyro.monitor.belief().bias(), bias);
}

TEST(YawMonitor, WhileTheRobotIsShakenTheTurnTellsNothing) {
  Gyro gyro;
  gyro.settle(0.5);
  const double slope = gyro.monitor.belief().slope(), yaw_rate = Gyro::asked(0.5) + 1.0;
  for (int k = 0; k < 20; ++k) {
    gyro.monitor.check(yaw_rate, {0.5, kSpread, 0.0}, true, kStep, {true, false});
    EXPECT_EQ(gyro.monitor.state(), kOk) << k;
  }
  EXPECT_EQ(gyro.monitor.belief().slope(), slope) << "nor of the slip";
  gyro.monitor.check(yaw_rate, {0.5, kSpread, 0.0}, true, kStep);
  EXPECT_EQ(gyro.monitor.state(), kOutlier);

  // Nor what is off by less than the bound, while the motion is new.
  Gyro turned;
  turned.settle(0.5);
  const double before = turned.monitor.belief().slope();
  turned.difference_rate = 5.0;
  turned.pass(0.1);
  turned.difference_rate = 0.0;
  for (int k = 0; k < 10; ++k) {
    turned.monitor.check(0.7 * Gyro::asked(0.5), {0.5, kSpread, 0.0}, true, kStep, {true, false});
    EXPECT_LT(turned.monitor.distance(), 1.0) << k;
  }
  EXPECT_EQ(turned.monitor.belief().slope(), before);
}

/// A patch of ice under one wheel changes the turn at once, and pushes the body as it does.
TEST(YawMonitor, ATurnThatJumpsWithAPushIsTheBodys) {
  const double less = 0.6 * Gyro::asked(0.5);
  for (const int late : {-2, 0, 2}) {  // samples by which the push is felt after the jump
    Gyro gyro;
    gyro.settle(0.5);
    if (late < 0) {
      gyro.shock.push = true;
      gyro.show(Gyro::asked(0.5), -late);
    }
    gyro.show(less, std::max(0, late));
    gyro.shock.push = late >= 0;
    gyro.show(less);
    gyro.shock.push = false;
    EXPECT_EQ(gyro.show(less, 100), late < 0 ? kFaulty : kOk) << late;
  }
  Gyro none;
  none.settle(0.5);
  EXPECT_EQ(none.show(less, 100), kFaulty) << "without a push the gyro is to blame";
}

TEST(YawMonitor, ATurnThatGoesOnAfterItJumpedIsTheBodys) {
  const double most = 0.75 * Gyro::asked(0.5), less = 0.6 * Gyro::asked(0.5);
  for (const int samples : {1, 2}) {  // in which it goes on
    Gyro gyro;
    gyro.settle(0.5);
    gyro.show(most, samples);
    EXPECT_EQ(gyro.show(less, 100), kOk) << samples;
  }
  Gyro late;
  late.settle(0.5);
  late.show(most, 5);
  EXPECT_EQ(late.show(less, 100), kFaulty) << "another motion than the one that jumped";
}

TEST(YawMonitor, WhereThereWereManyJoltsTheGroundTurnsABodyTwiceAsFar) {
  const auto afterATurnBy = [](int jolts, int samples) {
    Gyro gyro = jolted(jolts, 0.5);
    gyro.settle(0.1);
    gyro.shock.push = true;
    return gyro.show(Gyro::asked(0.1) + 0.4, samples);  // more than any ground explains
  };
  EXPECT_NE(afterATurnBy(0, 11), kOutlier) << "0.09 rad";
  EXPECT_EQ(afterATurnBy(8, 11), kOutlier);
  EXPECT_EQ(afterATurnBy(8, 20), kFaulty) << "0.16 rad";
}

TEST(YawMonitor, APushLongAfterAJumpOrWithATurnThatNoGroundMakesExplainsNothing) {
  Gyro late;
  late.settle(0.5);
  late.show(0.6 * Gyro::asked(0.5), 5);
  late.shock.push = true;
  EXPECT_EQ(late.show(0.6 * Gyro::asked(0.5), 20), kFaulty);
  Gyro much;
  much.settle(0.5);
  much.shock.push = true;
  EXPECT_EQ(much.show(1.7 * Gyro::asked(0.5), 20), kFaulty);
}

TEST(YawMonitor, TenOfSixteenOutliersAreAFault) {
  Gyro row;
  row.settle(0.0);
  EXPECT_EQ(row.show(0.3, 9), kOutlier);
  EXPECT_EQ(row.show(0.3), kFaulty);
  Gyro half;
  half.settle(0.0);
  for (int k = 0; k < 200; ++k) EXPECT_NE(half.show(k % 2 == 0 ? 0.3 : 0.0), kFaulty) << k;
}

TEST(YawMonitor, WheelsThatCrossASillOneAfterTheOtherTurnTheBodyToAndFro) {
  Gyro gyro;
  gyro.settle(0.0);
  for (const double yaw_rate : {0.3, 0.4, 0.4, 0.3, 0.15, -0.4, -0.55, -0.75, -0.8, -0.5}) gyro.show(yaw_rate);
  EXPECT_EQ(gyro.monitor.state(), kOutlier) << "ten of ten, in which the body turned by 0.03 rad";
  EXPECT_EQ(gyro.show(0.0), kOk);
}

TEST(YawMonitor, AKerbThatIsGrazedTurnsTheBodyByLessThanATwentiethOfARadian) {
  for (const double sign : {1.0, -1.0}) {
    Gyro kerb, bias, weak;
    for (Gyro* gyro : {&kerb, &bias, &weak}) gyro->settle(0.0);
    EXPECT_EQ(kerb.show(sign * 0.15, 16), kOutlier) << "0.048 rad";
    EXPECT_EQ(kerb.show(0.0), kOk);
    EXPECT_LE(bias.samplesUntil(kFaulty, sign * 0.2, 100), 13) << "0.052 rad, 0.26 s";
    EXPECT_NEAR(weak.samplesUntil(kFaulty, sign * 0.15, 100), 17, 1);
    EXPECT_EQ(kerb.show(0.0, 20), kOk);
    EXPECT_EQ(kerb.show(sign * 0.15, 16), kOutlier) << "what is over is forgotten";
  }
}

TEST(YawMonitor, GroundThatShakesARobotMayTurnItUpToTwiceAsFar) {
  for (const auto& [vibration, samples] :
       {std::pair(0.0, 13), std::pair(1.0, 19), std::pair(2.0, 26), std::pair(9.0, 26)}) {
    Gyro gyro;
    gyro.settle(0.0);
    gyro.shock.vibration = vibration;
    EXPECT_NEAR(gyro.samplesUntil(kFaulty, 0.2, 100), samples, 1) << vibration;
  }
}

TEST(YawMonitor, WhereLittleIsKnownOfTheTurnTheGroundMayTurnTheBodyFarther) {
  FaultParameters parameters;
  parameters.gyro_variance = 1.6e-3;
  Gyro gyro(parameters);
  gyro.settle(0.0);
  YawMonitor before = gyro.monitor;
  before.check(0.24, {0.0, kSpread, 0.0}, true, kStep);
  ASSERT_NEAR(before.distance(), 1.2, 0.1);
  EXPECT_NEAR(gyro.samplesUntil(kFaulty, 0.24, 100), 0.3 / (before.distance() * kPeriod), 1.5) << "0.06 rad";
}

TEST(YawMonitor, ACreepingRobotThatIsHeldAtOneSideTurnsAboutIt) {
  const auto stateAfter = [](double speed, std::initializer_list<double> yaw_rates) {
    Gyro gyro;
    gyro.forward = speed;
    gyro.settle(0.0);
    for (const double yaw_rate : yaw_rates) gyro.show(yaw_rate);
    return gyro.show(*(yaw_rates.end() - 1), 100);
  };
  const double turn = 0.1 / kTrack;  // of a side that stands, with 0.1 m/s at the other
  EXPECT_EQ(stateAfter(0.1, {0.3 * turn, 0.6 * turn, 0.9 * turn}), kOk);
  EXPECT_EQ(stateAfter(0.1, {-0.3 * turn, -0.6 * turn, -0.9 * turn}), kOk);
  EXPECT_EQ(stateAfter(-0.1, {0.3 * turn, 0.6 * turn, 0.9 * turn}), kOk);
  EXPECT_EQ(stateAfter(0.1, {0.5 * turn, turn, 1.5 * turn, turn}), kOk) << "a jump back to the wheels";
  EXPECT_EQ(stateAfter(0.1, {1.5 * turn}), kFaulty) << "a jump away from them";
  EXPECT_EQ(stateAfter(0.05, {0.3 * turn, 0.6 * turn, 0.9 * turn, 1.2 * turn}), kFaulty) << "faster than that";
  EXPECT_EQ(stateAfter(0.3, {0.3 * turn, 0.6 * turn, 0.9 * turn}), kFaulty) << "too fast to go unfelt";
}

TEST(YawMonitor, AGyroThatIsOffForASecondIsFaultyWhicheverWayItTurns) {
  Gyro gyro;
  gyro.settle(0.0);
  int samples = 0;
  for (; samples < 100 && gyro.monitor.state() != kFaulty; ++samples) gyro.show(samples % 2 == 0 ? 0.9 : -0.9);
  EXPECT_NEAR(samples, 51, 1);
}

TEST(YawMonitor, TheSignIsToldByHalfASecondOfTurning) {
  const auto isReversed = [](double part, double spread, int samples) {
    Gyro gyro;
    for (int k = 0; k < samples; ++k) gyro.monitor.check(part * Gyro::asked(0.26), {0.26, spread, 0.0}, true, kStep);
    return gyro.monitor.reversed();
  };
  EXPECT_FALSE(isReversed(-1.0, kSpread, 20));
  EXPECT_TRUE(isReversed(-1.0, kSpread, 30));
  EXPECT_TRUE(isReversed(-0.4, kSpread, 30));
  EXPECT_FALSE(isReversed(-0.2, kSpread, 30)) << "a body that slides";
  EXPECT_FALSE(isReversed(1.0, kSpread, 30));
  EXPECT_TRUE(isReversed(-1.0, 0.05, 30));
  EXPECT_FALSE(isReversed(-1.0, 0.1, 30)) << "wheels whose motion is unknown";
}

/// The state with a bias that the belief has learned on a straight line.
ChannelState withBias(double bias, double speed) {
  Gyro gyro;
  gyro.forward = speed;
  ChannelState state = gyro.show(bias, 100);
  for (int k = 0; k < 100; ++k) state = gyro.show(bias);
  return state;
}

TEST(YawMonitor, ABiasIsAFaultUnlessUnlikeTyresMakeIt) {
  for (const double sign : {1.0, -1.0}) {
    EXPECT_EQ(withBias(sign * 0.045, 0.0), kOk);
    EXPECT_EQ(withBias(sign * 0.06, 0.0), kFaulty);
    // Of the turn by tyres of 3 % difference at most: 0.055 rad/s at 1 m/s.
    EXPECT_EQ(withBias(sign * 0.095, 1.0), kOk);
    EXPECT_EQ(withBias(sign * 0.115, 1.0), kFaulty);
    EXPECT_EQ(withBias(sign * 0.095, -1.0), kOk);
    EXPECT_EQ(withBias(sign * 0.09, 0.5), kFaulty);
  }
}

/// A body that begins to turn before its encoders tell, or is shoved.
TEST(YawMonitor, OneSampleTeachesLittleOfTheBias) {
  for (const double period : {0.02, 0.05, 0.1}) {
    YawMonitor monitor(FaultParameters{}, kTrack);
    for (int k = 0; k < 20; ++k) {
      monitor.predict(0.0, 0.0, period);
      monitor.check(k == 19 ? 0.12 : 0.0, {0.0, kSpread, 0.5}, true,
                    {period, FaultParameters{}.covariance_time_constant});
    }
    EXPECT_LT(std::abs(monitor.belief().bias()), 0.03) << period;
  }
}

TEST(YawMonitor, ABiasIsAFaultOnceItIsSure) {
  const auto untilItIsFaulty = [](double yaw_rate) {
    Gyro gyro;
    gyro.pass(0.5);
    return 0.02 * gyro.samplesUntil(kFaulty, yaw_rate, 200);
  };
  // It is a mean over half a second at least, and has to be larger than the largest by two deviations.
  EXPECT_GT(untilItIsFaulty(0.065), 0.5);
  EXPECT_NEAR(untilItIsFaulty(0.08), 1.2, 0.3);
  EXPECT_EQ(untilItIsFaulty(0.045), 4.0) << "never";
}

/// A gyro that came to read another turn from one sample to the next. @param part of the turn asked for.
Gyro jumpedTo(double part, double bias = 0.0) {
  Gyro gyro;
  gyro.settle(0.5, bias);
  EXPECT_EQ(gyro.show(part * Gyro::asked(0.5) + bias, 50), kFaulty);
  return gyro;
}

TEST(YawMonitor, APlausibleSlipThatLastsTenSecondsIsBelieved) {
  for (const double part : {1.4, 0.65}) {
    Gyro gyro = jumpedTo(part, 0.02);
    const double other = part * Gyro::asked(0.5) + 0.02;
    EXPECT_EQ(gyro.show(other, 450), kFaulty) << "10 s and the recovery";
    EXPECT_LT(gyro.samplesUntil(kOk, other, 200), 100);
    EXPECT_NEAR(gyro.monitor.belief().relativeSlope(), part, 0.01) << "all of it at once";
    EXPECT_NEAR(gyro.monitor.belief().bias(), 0.02, 1e-3) << "a turn does not change it";
  }
  for (const double part : {1.9, 1.0 / 1.9}) {
    EXPECT_EQ(jumpedTo(part).show(part * Gyro::asked(0.5), 1500), kFaulty) << "more than 1.8 times is none";
  }
}

TEST(YawMonitor, TheTimeOfAgreementIsOfOneFault) {
  Gyro gyro = jumpedTo(1.4);
  gyro.show(1.4 * Gyro::asked(0.5), 350);
  EXPECT_EQ(gyro.show(Gyro::asked(0.5), 100), kOk);
  gyro.show(1.4 * Gyro::asked(0.5), 10);
  EXPECT_EQ(gyro.show(1.4 * Gyro::asked(0.5), 350), kFaulty);
}

TEST(YawMonitor, AGyroThatReadsAsBeforeCountsAgainAndNothingOfTheFaultIsBelieved) {
  Gyro gyro = jumpedTo(1.4);
  gyro.show(1.4 * Gyro::asked(0.5), 200);
  EXPECT_EQ(gyro.samplesUntil(kOk, Gyro::asked(0.5), 100), 50);
  EXPECT_NEAR(gyro.monitor.belief().relativeSlope(), 1.0, 0.01);
}

TEST(YawMonitor, ASlipThatAStraightLineTellsFromABiasIsBelievedAtOnce) {
  Gyro gyro = jumpedTo(1.4);
  gyro.x = 0.0;
  EXPECT_EQ(gyro.show(0.0, 30), kFaulty);
  gyro.x = 0.5;
  EXPECT_EQ(gyro.show(1.4 * Gyro::asked(0.5), 30), kOk);
  EXPECT_NEAR(gyro.monitor.belief().relativeSlope(), 1.4, 0.02);
}

TEST(YawMonitor, AGyroThatNoBeliefExplainsStaysOut) {
  for (const double size : {0.3, 0.035}) {
    Gyro gyro;
    gyro.settle(0.0);
    for (int k = 0; k < 200; ++k) gyro.show(k % 2 == 0 ? size : -size);
    EXPECT_EQ(gyro.monitor.state(), kFaulty) << size;
  }
}

/// Whether a gyro that freezes after some noise is found. @param change by the noise [rad/s], now and then 0.6 of it.
bool findsFrozen(double change) {
  YawMonitor monitor(FaultParameters{}, kTrack);
  double value = 0.0;
  for (int k = 0; k < 200; ++k) {
    value += (k % 40 < 2 ? 0.6 : 1.0) * (k % 2 == 0 ? change : -change);
    monitor.check(value, {0.0, kSpread, 0.0}, true, kStep);
  }
  bool found = false;
  for (int k = 0; k < 100; ++k) {
    monitor.check(-change, {0.0, kSpread, 0.0}, true, kStep);
    found |= monitor.frozen();
  }
  return found;
}

TEST(YawMonitor, ChangesBelowATenMillionthAreNoNoise) {
  EXPECT_TRUE(findsFrozen(0.005));
  EXPECT_TRUE(findsFrozen(2.2e-7));
  EXPECT_FALSE(findsFrozen(0.95e-7));
}

}  // namespace
}  // namespace jackal_aic
