#include "jackal_aic/safety/measurement_watch.hpp"

#include <gtest/gtest.h>

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
  possible.acceleration_z = 9.8;
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
  MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
  Observation spike;
  spike.wheel_left = spike.wheel_right = 200.0;
  for (int i = 1; i <= 12; ++i) {
    Observation sample = spike;
    watch.judge(sample, kSound, 1.0);
    EXPECT_EQ(after(watch, {}), i < 10 ? StopCause::none : StopCause::sensor_fault) << i << " samples";
  }
  Observation sound;
  watch.judge(sound, kSound, 1.0);
  EXPECT_EQ(after(watch, {}), StopCause::none);
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
    nonsense.yaw_rate = 1e300;
    watch.judge(nonsense, kSound, 1.0);
  }
  EXPECT_EQ(after(watch, {}), StopCause::none);
  EXPECT_EQ(reason(watch), "yaw rate lost");
}

}  // namespace
}  // namespace jackal_aic
