#include "measurement_watch.hpp"

#include <gtest/gtest.h>

namespace jackal_aic {
namespace {

NodeParameters parameters(LossAction imu, LossAction one_wheel, LossAction wheels) {
  NodeParameters p;
  p.controller = ControllerParameters{};
  p.on_loss = {imu, one_wheel, wheels, 1.0};
  return p;
}

/// What is left of some causes after the policy.
StopCause after(MeasurementWatch& watch, std::initializer_list<StopCause> present) {
  StopCauses causes;
  for (StopCause cause : present) causes.add(cause, true);
  watch.applyPolicy(causes, 1.0, false);
  return causes.worst();
}

constexpr auto kDrive = LossAction::drive;
constexpr auto kStop = LossAction::stop;

TEST(MeasurementWatch, WithNothingLostNothingChanges) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kDrive));
  EXPECT_EQ(after(watch, {}), StopCause::none);
  EXPECT_EQ(after(watch, {StopCause::unpaired}), StopCause::unpaired);
  EXPECT_EQ(after(watch, {StopCause::set_point_late}), StopCause::set_point_late);
  EXPECT_EQ(watch.reason(), "");
}

TEST(MeasurementWatch, ALostImuIsToleratedOrNot) {
  MeasurementWatch drives(parameters(kDrive, kStop, kStop)), stops(parameters(kStop, kDrive, kDrive));
  for (StopCause cause : {StopCause::imu_late, StopCause::imu_frozen, StopCause::imu_missing}) {
    EXPECT_EQ(after(drives, {StopCause::unpaired, cause}), StopCause::none) << text(cause);
    EXPECT_EQ(drives.imuSilent(), cause != StopCause::imu_frozen);
    EXPECT_EQ(drives.reason(), "yaw rate lost");
    EXPECT_EQ(after(stops, {StopCause::unpaired, cause}), cause);
  }
  EXPECT_EQ(after(drives, {StopCause::imu_late, StopCause::emergency_stop}), StopCause::emergency_stop);
  EXPECT_EQ(after(drives, {}), StopCause::none);
  EXPECT_EQ(drives.reason(), "") << "it is back";
}

TEST(MeasurementWatch, TheThesisControllerStopsWithoutWheelsWhateverThePolicy) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kDrive));
  EXPECT_EQ(after(watch, {StopCause::wheels_late}), StopCause::wheels_late);
  EXPECT_TRUE(watch.wheelsSilent());
  EXPECT_EQ(after(watch, {StopCause::wheels_frozen, StopCause::imu_late}), StopCause::wheels_frozen);
}

TEST(MeasurementWatch, ThePredictiveControllerDrivesOnItsModelForAWhile) {
  NodeParameters p = parameters(kDrive, kDrive, kDrive);
  p.controller = PredictiveParameters{};
  MeasurementWatch watch(p);
  Observation seen;
  watch.judge(seen, 1.0);
  StopCauses soon, late;
  soon.add(StopCause::wheels_late, true);
  late.add(StopCause::wheels_late, true);
  watch.applyPolicy(soon, 1.9, false);
  EXPECT_EQ(soon.worst(), StopCause::none);
  watch.applyPolicy(late, 2.1, false);
  EXPECT_EQ(late.worst(), StopCause::wheels_late) << "model_time is over";
}

TEST(MeasurementWatch, ChannelsOfALostSourceDoNotCount) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
  Observation observation;
  watch.judge(observation, 1.0);
  EXPECT_EQ(observation.valid, ChannelValidity{});
  after(watch, {StopCause::imu_frozen});
  watch.judge(observation, 1.0);
  EXPECT_EQ(observation.valid, (ChannelValidity{false, true, true, false}));
}

TEST(MeasurementWatch, ReadingsThatNoRobotHasDoNotCount) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
  Observation possible;
  possible.wheel_left = -100.0;
  possible.yaw_rate = 19.0;
  possible.acceleration_z = 9.8;
  watch.judge(possible, 1.0);
  EXPECT_EQ(possible.valid, ChannelValidity{});
  Observation impossible;
  impossible.wheel_left = 200.0;
  impossible.yaw_rate = -1e300;
  impossible.acceleration_y = 101.0;
  watch.judge(impossible, 1.02);
  EXPECT_EQ(impossible.valid, (ChannelValidity{false, false, true, false}));
}

TEST(MeasurementWatch, SourcesThatSpeakWithoutTellingTheMotionStop) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
  Observation spike;
  spike.wheel_left = spike.wheel_right = 200.0;
  for (int i = 1; i <= 12; ++i) {
    Observation sample = spike;
    watch.judge(sample, 1.0);
    EXPECT_EQ(after(watch, {}), i < 10 ? StopCause::none : StopCause::sensor_fault) << i << " samples";
  }
  Observation sound;
  watch.judge(sound, 1.0);
  EXPECT_EQ(after(watch, {}), StopCause::none);
}

TEST(MeasurementWatch, ASourceThatComesBackCountsAtOnce) {
  MeasurementWatch watch(parameters(kDrive, kStop, kStop));
  EXPECT_EQ(after(watch, {StopCause::wheels_late}), StopCause::wheels_late);
  for (int i = 0; i < 20; ++i) {
    Observation imu_alone;
    watch.judge(imu_alone, 1.0);
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
    watch.judge(sample, sample.stamp);
    for (int step = 0; step < 20; ++step) watch.advance({}, 0.001);
  }
  return !watch.reason().empty();
}

TEST(MeasurementWatch, WhatTheMotorsDidDuringAStallIsNoFault) {
  NodeParameters with_model = parameters(kDrive, kDrive, kStop);
  with_model.plant_model = PlantModel{};
  MeasurementWatch watch(with_model);
  EXPECT_TRUE(findsTheFault(watch, 1.0, 25));
  watch.forgiveStall(2.0);
  EXPECT_FALSE(findsTheFault(watch, 2.0, 15));
  EXPECT_TRUE(watch.trustsBlindly(2.29));
  EXPECT_FALSE(watch.trustsBlindly(2.31));
  EXPECT_TRUE(findsTheFault(watch, 2.3, 25)) << "blind for ever";
}

TEST(MeasurementWatch, AStartIsNoLoss) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
  EXPECT_EQ(after(watch, {StopCause::unpaired, StopCause::imu_missing, StopCause::wheels_missing}),
            StopCause::wheels_missing);
  EXPECT_EQ(watch.reason(), "");
  EXPECT_EQ(after(watch, {StopCause::unpaired, StopCause::imu_missing}), StopCause::imu_missing);
  EXPECT_FALSE(watch.imuSilent()) << "it may come any moment";
  EXPECT_EQ(watch.reason(), "");
}

TEST(MeasurementWatch, ASourceThatComesBackAfterLongLeavesNoFault) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
  Observation seen;
  watch.judge(seen, 1.0);
  for (double now : {1.3, 1.8, 2.3}) {
    StopCauses late;
    late.add(StopCause::wheels_late, true);
    watch.applyPolicy(late, now, false);
    Observation imu_alone;
    imu_alone.valid.wheel_left = imu_alone.valid.wheel_right = false;
    for (int i = 0; i < 25; ++i) watch.judge(imu_alone, now);
  }
  StopCauses back;
  watch.applyPolicy(back, 2.32, false);
  EXPECT_EQ(back.worst(), StopCause::none) << watch.reason();
}

TEST(MeasurementWatch, ASourceThatDoesNotComeAtAllIsLost) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
  for (double now : {1.0, 1.5, 2.1}) {
    StopCauses causes;
    causes.add(StopCause::unpaired, true).add(StopCause::imu_missing, true);
    watch.applyPolicy(causes, now, false);
    EXPECT_EQ(watch.imuSilent(), now > 2.0);
    EXPECT_EQ(causes.worst(), now > 2.0 ? StopCause::none : StopCause::imu_missing);
  }
}

TEST(MeasurementWatch, ACauseOfItsOwnIsNotToldTwice) {
  MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
  EXPECT_EQ(after(watch, {StopCause::wheels_late, StopCause::unpaired}), StopCause::wheels_late);
  EXPECT_EQ(watch.reason(), "");
}

/// A robot at rest whose wheels are turned, and its watch; the monitor knows the drive train.
TEST(MeasurementWatch, APushedRobotHasNoFault) {
  NodeParameters with_model = parameters(kDrive, kDrive, kStop);
  with_model.plant_model = PlantModel{};
  MeasurementWatch watch(with_model);
  for (int i = 0; i < 300; ++i) {
    const double noise = 0.001 * (i * 7 % 5), push = i > 100 && i < 200 ? 4.0 : 0.0;
    Observation sample;
    sample.stamp = 1.0 + 0.02 * i;
    sample.wheel_left = sample.wheel_right = push + noise;
    sample.yaw_rate = sample.acceleration_x = noise;
    watch.judge(sample, sample.stamp);
    for (int step = 0; step < 20; ++step) watch.advance({0.01, -0.01}, 0.001);
    StopCauses causes;
    watch.applyPolicy(causes, sample.stamp, false);
    if (i < 100 || i > 210) {
      EXPECT_EQ(causes.worst(), StopCause::none) << "sample " << i;
    } else if (i > 106 && i < 199) {
      EXPECT_EQ(causes.worst(), StopCause::moved) << "sample " << i;
    }
    EXPECT_EQ(watch.reason(), "") << "sample " << i;
  }
  EXPECT_EQ(watch.reason(), "");
  EXPECT_EQ(watch.detected(), 0u);
}

TEST(MeasurementWatch, AnImuThatSpeaksNonsenseIsLost) {
  MeasurementWatch watch(parameters(kDrive, kStop, kStop));
  for (int i = 0; i < 10; ++i) {
    Observation nonsense;
    nonsense.yaw_rate = 1e300;
    watch.judge(nonsense, 1.0);
  }
  EXPECT_EQ(after(watch, {}), StopCause::none);
  EXPECT_EQ(watch.reason(), "yaw rate lost");
}

}  // namespace
}  // namespace jackal_aic
