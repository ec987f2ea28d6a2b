#include "jackal_aic/safety/measurement_watch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>
#include <string>

namespace jackal_aic {
namespace {

MeasurementWatchParameters parameters(LossAction imu, LossAction one_wheel, LossAction wheels) {
  MeasurementWatchParameters p;
  p.on_loss = {imu, one_wheel, wheels, 1.0};
  p.faults = FaultParameters{};
  return p;
}

const SensorHealth kSound{};

SensorHealth healthOf(std::initializer_list<StopCause> causes) {
  StopCauses present;
  for (StopCause cause : causes) present.add(cause, true);
  const auto has = [&present](StopCause cause) { return present.hasAny({cause}); };
  SensorHealth health;
  health.wheels = {has(StopCause::wheels_missing), has(StopCause::wheels_late), has(StopCause::wheels_frozen)};
  health.imu = {has(StopCause::imu_missing), has(StopCause::imu_late), has(StopCause::imu_frozen)};
  health.unpaired = has(StopCause::unpaired);
  return health;
}

/// What keeps the robot from driving on the move.
StopCause after(MeasurementWatch& watch, std::initializer_list<StopCause> losses, double now = 1.0) {
  return watch.causes(healthOf(losses), now, false).worst();
}

/// What a person is told.
std::string reason(const MeasurementWatch& watch) {
  const bool faulty = watch.report() && watch.report()->faulty();
  return faulty ? text(watch.fault()) : text(watch.loss());
}

constexpr auto kDrive = LossAction::drive;
constexpr auto kStop = LossAction::stop;

TEST(MeasurementWatch, WithNothingLostNothingChanges) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kDrive));
  EXPECT_EQ(after(watch, {}), StopCause::none);
  EXPECT_EQ(after(watch, {StopCause::unpaired}), StopCause::unpaired);
  EXPECT_EQ(reason(watch), "");
}

TEST(MeasurementWatch, ALostImuIsToleratedOrNot) {
  MeasurementWatch drives(parameters(kDrive, kStop, kStop)), stops(parameters(kStop, kDrive, kDrive));
  for (StopCause cause : {StopCause::imu_late, StopCause::imu_frozen, StopCause::imu_missing}) {
    EXPECT_EQ(after(drives, {StopCause::unpaired, cause}), StopCause::none) << text(cause);
    EXPECT_EQ(reason(drives), "yaw rate lost");
    EXPECT_EQ(after(stops, {StopCause::unpaired, cause}), cause);
  }
  EXPECT_EQ(after(drives, {}), StopCause::none);
  EXPECT_EQ(reason(drives), "") << "it is back";
}

TEST(MeasurementWatch, TheThesisControllerStopsWithoutWheelsWhateverThePolicy) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kDrive));
  EXPECT_EQ(after(watch, {StopCause::wheels_late}), StopCause::wheels_late);
  EXPECT_EQ(after(watch, {StopCause::wheels_frozen, StopCause::imu_late}), StopCause::wheels_frozen);
}

TEST(MeasurementWatch, ThePredictiveControllerDrivesOnItsModelForAWhile) {
  MeasurementWatchParameters p = parameters(kDrive, kDrive, kDrive);
  p.tolerance = LossTolerance::model;
  MeasurementWatch watch(p);
  Observation seen;
  watch.judge(seen, kSound, 1.0);
  EXPECT_EQ(after(watch, {StopCause::wheels_late}, 1.9), StopCause::none);
  EXPECT_EQ(after(watch, {StopCause::wheels_late}, 2.1), StopCause::wheels_late) << "model_time is over";
}

TEST(MeasurementWatch, ChannelsOfALostSourceDoNotCount) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
  Observation observation;
  watch.judge(observation, kSound, 1.0);
  EXPECT_EQ(observation.valid, ChannelValidity{});
  watch.judge(observation, healthOf({StopCause::imu_frozen}), 1.0);
  EXPECT_EQ(observation.valid, (ChannelValidity{false, true, true, false}));
}

TEST(MeasurementWatch, ReadingsThatNoRobotHasDoNotCount) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
  Observation possible;
  possible.wheel_left = -100.0;
  possible.yaw_rate = 19.0;
  watch.judge(possible, kSound, 1.0);
  EXPECT_EQ(possible.valid, ChannelValidity{});
  Observation impossible;
  impossible.wheel_left = 200.0;
  impossible.yaw_rate = -1e300;
  impossible.acceleration_y = 101.0;
  watch.judge(impossible, kSound, 1.02);
  EXPECT_EQ(impossible.valid, (ChannelValidity{false, false, true, false}));
}

TEST(MeasurementWatch, SourcesThatSpeakWithoutTellingTheMotionStop) {
  for (const double rate : {10.0, 20.0, 50.0, 100.0}) {
    MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
    Observation sound;
    sound.stamp = 1.0;
    watch.judge(sound, kSound, 1.0);
    for (int i = 1; i <= std::lround(0.3 * rate); ++i) {
      Observation sample;
      sample.stamp = 1.0 + i / rate;
      sample.wheel_left = sample.wheel_right = 200.0;
      watch.judge(sample, kSound, sample.stamp);
      const bool lost = i / rate > 0.2 - 1e-9;
      EXPECT_EQ(after(watch, {}), lost ? StopCause::sensor_fault : StopCause::none) << rate << " Hz, " << i;
    }
    sound.stamp = 2.0;
    watch.judge(sound, kSound, 2.0);
    EXPECT_EQ(after(watch, {}), StopCause::none);
  }
}

TEST(MeasurementWatch, AStampThatIsNoNumberLetsNoTimePass) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
  for (const double stamp : {1.0, std::nan(""), 1.04}) {
    Observation spike;
    spike.stamp = stamp;
    spike.wheel_left = spike.wheel_right = 200.0;
    watch.judge(spike, kSound, 1.0);
    EXPECT_EQ(after(watch, {}), StopCause::none) << stamp;
  }
}

TEST(MeasurementWatch, ASourceThatComesBackCountsAtOnce) {
  MeasurementWatch watch(parameters(kDrive, kStop, kStop));
  EXPECT_EQ(after(watch, {StopCause::wheels_late}), StopCause::wheels_late);
  for (int i = 0; i < 20; ++i) {
    Observation imu_alone;
    watch.judge(imu_alone, kSound, 1.0);
  }
  EXPECT_EQ(after(watch, {}), StopCause::none);
}

/// Whether a gyro that turns by itself is found within some samples.
bool findsTheFault(MeasurementWatch& watch, double now, int samples) {
  for (int i = 0; i < samples; ++i) {
    const double noise = 0.001 * (i % 5);
    Observation sample;
    sample.stamp = now + 0.02 * i;
    sample.wheel_left = sample.wheel_right = sample.acceleration_x = noise;
    sample.yaw_rate = 1.0 + noise;
    watch.judge(sample, kSound, sample.stamp);
    for (int step = 0; step < 20; ++step) watch.advance(WheelCommand{}, 0.001);
  }
  return !reason(watch).empty();
}

TEST(MeasurementWatch, WhatTheMotorsDidDuringAStallIsNoFault) {
  MeasurementWatchParameters with_model = parameters(kDrive, kDrive, kStop);
  with_model.plant_model = PlantModel{};
  MeasurementWatch watch(with_model);
  EXPECT_TRUE(findsTheFault(watch, 1.0, 25));
  watch.resumeAfterStall(2.0);
  EXPECT_FALSE(findsTheFault(watch, 2.0, 15));
  EXPECT_TRUE(watch.recoversFromStall(2.29));
  EXPECT_FALSE(watch.recoversFromStall(2.31));
  EXPECT_TRUE(findsTheFault(watch, 2.3, 25)) << "blind for ever";
}

TEST(MeasurementWatch, AStartIsNoLoss) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
  EXPECT_EQ(after(watch, {StopCause::unpaired, StopCause::imu_missing, StopCause::wheels_missing}),
            StopCause::wheels_missing);
  EXPECT_EQ(reason(watch), "");
  EXPECT_EQ(after(watch, {StopCause::unpaired, StopCause::imu_missing}), StopCause::imu_missing);
  EXPECT_FALSE(watch.started()) << "it may come any moment";
  EXPECT_EQ(reason(watch), "");
}

TEST(MeasurementWatch, ASourceThatComesBackAfterLongLeavesNoFault) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
  Observation seen;
  watch.judge(seen, kSound, 1.0);
  const SensorHealth silent = healthOf({StopCause::wheels_late});
  for (double now : {1.3, 1.8, 2.3}) {
    watch.causes(silent, now, false);
    Observation imu_alone;
    imu_alone.valid.wheel_left = imu_alone.valid.wheel_right = false;
    for (int i = 0; i < 25; ++i) watch.judge(imu_alone, silent, now);
  }
  EXPECT_EQ(after(watch, {}, 2.32), StopCause::none) << reason(watch);
}

TEST(MeasurementWatch, ASourceThatDoesNotComeAtAllIsLost) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
  for (double now : {1.0, 1.5, 2.1}) {
    const StopCause cause = after(watch, {StopCause::unpaired, StopCause::imu_missing}, now);
    EXPECT_EQ(watch.started(), now > 2.0);
    EXPECT_EQ(cause, now > 2.0 ? StopCause::none : StopCause::imu_missing);
  }
}

TEST(MeasurementWatch, ACauseOfItsOwnIsNotToldTwice) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
  EXPECT_EQ(after(watch, {StopCause::wheels_late, StopCause::unpaired}), StopCause::wheels_late);
  EXPECT_EQ(reason(watch), "");
}

/// A robot at rest whose wheels are turned, and its watch; the monitor knows the drive train.
TEST(MeasurementWatch, APushedRobotHasNoFault) {
  MeasurementWatchParameters with_model = parameters(kDrive, kDrive, kStop);
  with_model.plant_model = PlantModel{};
  MeasurementWatch watch(with_model);
  for (int i = 0; i < 300; ++i) {
    const double noise = 0.001 * (i * 7 % 5), push = i > 100 && i < 200 ? 4.0 : 0.0;
    Observation sample;
    sample.stamp = 1.0 + 0.02 * i;
    sample.wheel_left = sample.wheel_right = push + noise;
    sample.yaw_rate = sample.acceleration_x = noise;
    watch.judge(sample, kSound, sample.stamp);
    for (int step = 0; step < 20; ++step) watch.advance(WheelCommand{0.01, -0.01}, 0.001);
    const StopCauses causes = watch.causes(kSound, sample.stamp, false);
    if (i < 100 || i > 210) {
      EXPECT_EQ(causes.worst(), StopCause::none) << "sample " << i;
    } else if (i > 106 && i < 199) {
      EXPECT_EQ(causes.worst(), StopCause::moved) << "sample " << i;
    }
    EXPECT_EQ(reason(watch), "") << "sample " << i;
  }
  EXPECT_EQ(reason(watch), "");
  EXPECT_EQ(watch.detected(), 0u);
}

TEST(MeasurementWatch, AnImuThatSpeaksNonsenseIsLost) {
  MeasurementWatch watch(parameters(kDrive, kStop, kStop));
  for (int i = 0; i < 10; ++i) {
    Observation nonsense;
    nonsense.stamp = 1.0 + 0.025 * i;
    nonsense.yaw_rate = 1e300;
    watch.judge(nonsense, kSound, nonsense.stamp);
  }
  EXPECT_EQ(after(watch, {}), StopCause::none);
  EXPECT_EQ(reason(watch), "yaw rate lost");
}

TEST(MeasurementWatch, TheBaselineIsAskedNothing) {
  MeasurementWatchParameters p = parameters(kStop, kStop, kStop);
  p.tolerance = LossTolerance::open_loop;
  MeasurementWatch watch(p);
  EXPECT_EQ(after(watch, {StopCause::wheels_missing, StopCause::imu_missing, StopCause::unpaired}), StopCause::none);
  Observation seen;
  watch.judge(seen, kSound, 1.0);
  EXPECT_EQ(after(watch, {StopCause::wheels_late, StopCause::imu_late}, 9.0), StopCause::none);
}

TEST(MeasurementWatch, ChannelsOfLostWheelsDoNotCountEither) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kDrive));
  Observation observation;
  watch.judge(observation, healthOf({StopCause::wheels_late}), 1.0);
  EXPECT_EQ(observation.valid, (ChannelValidity{true, false, false, true}));
}

TEST(MeasurementWatch, AnExcludedGyroIsALossLikeASilentOne) {
  for (const LossAction imu : {kDrive, kStop}) {
    MeasurementWatchParameters with_model = parameters(imu, kDrive, kDrive);
    with_model.plant_model = PlantModel{};
    MeasurementWatch watch(with_model);
    ASSERT_TRUE(findsTheFault(watch, 1.0, 40));
    EXPECT_EQ(watch.detected(), 1u) << "one fault, however long it lasts";
    EXPECT_EQ(after(watch, {}, 1.8), imu == kDrive ? StopCause::none : StopCause::sensor_fault);
    EXPECT_EQ(watch.causes(kSound, 1.8, true).worst(), StopCause::none) << "no stop of a robot that stands";
    watch.reset();
    EXPECT_FALSE(watch.report()->faulty());
    EXPECT_EQ(after(watch, {}, 1.8), StopCause::none);
  }
}

/// Of which one channel counts, each in its turn with i: none is missing for long.
Observation ofOneChannel(int i) {
  Observation sample;
  sample.stamp = 1.0 + 0.02 * i;
  if (i % 3 != 0) sample.wheel_left = 200.0;
  if (i % 3 != 1) sample.wheel_right = 200.0;
  if (i % 3 != 2) sample.yaw_rate = 1e3;
  return sample;
}

TEST(MeasurementWatch, TooFewChannelsAtATimeStop) {
  for (const bool monitored : {false, true}) {
    MeasurementWatchParameters p = parameters(kDrive, kDrive, kDrive);
    if (monitored) p.plant_model = PlantModel{};
    MeasurementWatch watch(p);
    for (int i = 1; i <= 20; ++i) {
      Observation sample = ofOneChannel(i);
      watch.judge(sample, kSound, sample.stamp);
      EXPECT_EQ(after(watch, {}, sample.stamp), i <= 16 ? StopCause::none : StopCause::sensor_fault) << i;
    }
    EXPECT_EQ(watch.loss(), Loss::unclear);
    Observation sound;
    sound.stamp = 2.0;
    watch.judge(sound, kSound, 2.0);
    EXPECT_EQ(after(watch, {}, 2.0), StopCause::none);
  }
}

/// The watch of a robot that drives at 5 rad/s of its wheels, and what it measures.
struct DrivingWatch {
  MeasurementWatch watch;
  int sample = 0;

  static MeasurementWatchParameters withModel() {
    MeasurementWatchParameters p = parameters(kDrive, kStop, kStop);
    p.plant_model = PlantModel{};
    return p;
  }

  DrivingWatch() : watch(withModel()) {}

  StopCause step(double left, double right, double noise = 0.01) {
    const double stamp = 1.0 + 0.02 * ++sample;
    const auto noisy = [&](double scale) { return scale * noise * ((sample * 7) % 11 - 5); };
    Observation y;
    y.stamp = stamp;
    y.wheel_left = left + noisy(1.0);
    y.wheel_right = right - noisy(1.0);
    y.yaw_rate = 0.001 * ((sample * 5) % 7);
    y.acceleration_x = 0.01 * ((sample * 3) % 5);
    watch.judge(y, kSound, stamp);
    for (int i = 0; i < 20; ++i) watch.advance(WheelCommand{5.0, 5.0}, 0.001);
    return watch.causes(kSound, stamp, false).worst();
  }
};

TEST(MeasurementWatch, OneWheelThatDoesNotFollowStops) {
  for (const bool left : {true, false}) {
    DrivingWatch robot;
    for (int i = 0; i < 100; ++i) robot.step(5.0, 5.0);
    EXPECT_EQ(robot.step(5.0, 5.0), StopCause::none);
    StopCause cause = StopCause::none;
    for (int i = 0; i < 60; ++i) cause = left ? robot.step(0.0, 5.0) : robot.step(5.0, 0.0);
    EXPECT_EQ(cause, StopCause::sensor_fault);
  }
}

TEST(MeasurementWatch, BothEncodersThatRepeatAreLeftToTheirSourceForAWhile) {
  DrivingWatch robot;
  for (int i = 0; i < 100; ++i) robot.step(5.0, 5.0);
  int repeating = 0, tolerated = 0;
  StopCause cause = StopCause::none;
  for (int i = 0; i < 100 && cause == StopCause::none; ++i) {
    cause = robot.step(5.0, 5.0, 0.0);
    const FaultReport& report = *robot.watch.report();
    repeating += report.wheel_left.cause == FaultCause::frozen && report.wheel_right.cause == FaultCause::frozen;
    tolerated += repeating > 0 && cause == StopCause::none;
  }
  EXPECT_EQ(cause, StopCause::sensor_fault);
  EXPECT_EQ(tolerated, 15) << "0.3 s, in which deadlines.frozen_wheels decides";
}

TEST(MeasurementWatch, NothingHasSpokenForLongIsAStartAllTheSame) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
  EXPECT_EQ(after(watch, {StopCause::imu_missing, StopCause::wheels_missing}, 1.0), StopCause::wheels_missing);
  EXPECT_EQ(after(watch, {StopCause::imu_missing, StopCause::wheels_missing}, 50.0), StopCause::wheels_missing);
  EXPECT_FALSE(watch.started());
  EXPECT_EQ(after(watch, {StopCause::imu_missing}, 60.0), StopCause::imu_missing) << "may come within a second";
  EXPECT_FALSE(watch.started());
  EXPECT_EQ(after(watch, {StopCause::imu_missing}, 60.9), StopCause::imu_missing);
  Observation first;
  watch.judge(first, kSound, 60.95);
  EXPECT_TRUE(watch.started());
}

TEST(MeasurementWatch, AnImuThatComesBackCountsAtOnce) {
  MeasurementWatch watch(parameters(kDrive, kStop, kStop));
  const SensorHealth silent = healthOf({StopCause::imu_late});
  for (int i = 0; i < 20; ++i) {
    Observation wheels_alone;
    watch.judge(wheels_alone, silent, 1.0);
    after(watch, {StopCause::imu_late});
  }
  EXPECT_EQ(watch.loss(), Loss::yaw_rate);
  EXPECT_EQ(after(watch, {}), StopCause::none);
  EXPECT_EQ(watch.loss(), Loss::none);
}

/// A source is lost for 0.6 s, in which samples like this one come.
void lose(MeasurementWatch& watch, StopCause cause, const Observation& sample) {
  Observation seen;
  watch.judge(seen, kSound, 1.0);
  const SensorHealth silent = healthOf({cause});
  watch.causes(silent, 1.0, false);
  for (int i = 1; i <= 30; ++i) {
    Observation next = sample;
    next.stamp = 1.0 + 0.02 * i;
    watch.judge(next, silent, next.stamp);
  }
}

TEST(MeasurementWatch, WhatWheelsMissedWhileTheyWereLostIsForgottenWhenTheyComeBack) {
  MeasurementWatchParameters p = parameters(kDrive, kDrive, kDrive);
  p.tolerance = LossTolerance::model;
  MeasurementWatch watch(p);
  lose(watch, StopCause::wheels_late, {});
  EXPECT_EQ(after(watch, {}, 1.6), StopCause::none);
  EXPECT_EQ(watch.loss(), Loss::none);
}

TEST(MeasurementWatch, NonsenseOfAnImuThatWasLostIsForgottenWhenItComesBack) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kDrive));
  Observation nonsense;
  nonsense.yaw_rate = 1e3;
  lose(watch, StopCause::imu_late, nonsense);
  EXPECT_EQ(after(watch, {}, 1.6), StopCause::none);
  EXPECT_EQ(watch.loss(), Loss::none);
}

TEST(MeasurementWatch, AResetForgetsThatTooFewChannelsCounted) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kDrive));
  for (int i = 1; i <= 20; ++i) {
    Observation sample = ofOneChannel(i);
    watch.judge(sample, kSound, sample.stamp);
  }
  ASSERT_EQ(after(watch, {}, 1.4), StopCause::sensor_fault);
  watch.reset();
  EXPECT_EQ(after(watch, {}, 1.4), StopCause::none);
}

TEST(MeasurementWatch, ARestartWaitsForTheFirstMeasurementsAgain) {
  MeasurementWatchParameters p = parameters(kDrive, kDrive, kDrive);
  p.tolerance = LossTolerance::model;
  MeasurementWatch watch(p);
  Observation seen;
  watch.judge(seen, kSound, 10.0);
  ASSERT_TRUE(watch.started());
  for (int i = 0; i < 12; ++i) {
    Observation nonsense;
    nonsense.stamp = 10.0 + 0.02 * i;
    nonsense.wheel_left = nonsense.wheel_right = nonsense.yaw_rate = 1e6;
    watch.judge(nonsense, kSound, nonsense.stamp);
  }
  EXPECT_EQ(after(watch, {}, 10.5), StopCause::none) << "on the model";
  EXPECT_EQ(watch.loss(), Loss::both_encoders);
  watch.restart(2.0);
  EXPECT_FALSE(watch.started());
  EXPECT_EQ(watch.loss(), Loss::none);
  EXPECT_TRUE(watch.recoversFromStall(2.1));
  EXPECT_EQ(after(watch, {StopCause::imu_missing}, 2.2), StopCause::imu_missing);
  EXPECT_FALSE(watch.started()) << "what was first before is of the past";
  watch.judge(seen, kSound, 2.3);
  EXPECT_EQ(after(watch, {StopCause::wheels_late}, 3.2), StopCause::none) << "seen 0.9 s ago";
  watch.reset();
  EXPECT_FALSE(watch.recoversFromStall(2.1));
}

TEST(MeasurementWatch, AfterAStallTheModelTimeCountsFromItsEnd) {
  MeasurementWatchParameters p = parameters(kDrive, kDrive, kDrive);
  p.tolerance = LossTolerance::model;
  MeasurementWatch watch(p);
  Observation seen;
  watch.judge(seen, kSound, 1.0);
  watch.resumeAfterStall(5.0);
  EXPECT_EQ(after(watch, {StopCause::wheels_late}, 5.9), StopCause::none);
  EXPECT_EQ(after(watch, {StopCause::wheels_late}, 6.1), StopCause::wheels_late);
}

TEST(MeasurementWatch, TheBoundOfAnAccelerationIsTenG) {
  for (const double acceleration : {99.0, 101.0}) {
    MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
    Observation sample;
    sample.acceleration_x = acceleration;
    watch.judge(sample, kSound, 1.0);
    EXPECT_EQ(sample.valid.acceleration, acceleration < 100.0);
  }
}

}  // namespace
}  // namespace jackal_aic
