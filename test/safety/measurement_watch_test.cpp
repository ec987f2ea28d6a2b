#include "jackal_aic/safety/measurement_watch.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "jackal_aic/safety/loss_policy.hpp"

namespace jackal_aic {
namespace {

constexpr auto kDrive = LossAction::drive, kStop = LossAction::stop;
const SensorHealth kSound{};

MeasurementWatchParameters parameters(LossAction imu, LossAction one_wheel, LossAction wheels) {
  MeasurementWatchParameters p;
  p.on_loss = {imu, one_wheel, wheels, 1.0};
  p.faults = FaultParameters{};
  return p;
}

/// The predictive controller's: drives on its model for a second.
MeasurementWatchParameters onModel() { return parameters(kDrive, kDrive, kDrive); }

MeasurementWatchParameters monitored(LossAction imu, LossAction one_wheel, LossAction wheels) {
  MeasurementWatchParameters p = parameters(imu, one_wheel, wheels);
  p.plant_model = PlantModel{};
  return p;
}

SensorHealth healthOf(StopCause cause) {
  const auto is = [cause](StopCause other) { return cause == other; };
  SensorHealth health;
  health.wheels = {is(StopCause::wheels_missing), is(StopCause::wheels_late), is(StopCause::wheels_frozen)};
  health.imu = {is(StopCause::imu_missing), is(StopCause::imu_late), is(StopCause::imu_frozen)};
  return health;
}

/// The cause that keeps a moving robot from driving.
StopCause after(MeasurementWatch& watch, StopCause loss = StopCause::none, double now = 1.0) {
  return watch.causes(healthOf(loss), now, false).worst();
}

Observation sampleAt(double stamp, double wheels = 0.0, double yaw_rate = 0.0) {
  Observation y;
  y.stamp = stamp;
  y.wheel_left = y.wheel_right = wheels;
  y.yaw_rate = yaw_rate;
  return y;
}

void judge(MeasurementWatch& watch, Observation sample, const SensorHealth& health = kSound) {
  watch.judge(sample, health, sample.stamp);
}

TEST(MeasurementWatch, PredictiveControllerDrivesOnItsModelForASecond) {
  MeasurementWatch watch(onModel());
  judge(watch, sampleAt(1.0));
  EXPECT_EQ(after(watch, StopCause::wheels_late, 1.9), StopCause::none);
  EXPECT_EQ(after(watch, StopCause::wheels_late, 2.1), StopCause::wheels_late);
  watch.restartAfterStall(5.0);  // the second counts from the end of a stall
  EXPECT_EQ(after(watch, StopCause::wheels_late, 5.9), StopCause::none);
  EXPECT_EQ(after(watch, StopCause::wheels_late, 6.1), StopCause::wheels_late);
}

TEST(MeasurementWatch, RestartWaitsForTheFirstMeasurementsAgain) {
  MeasurementWatch watch(onModel());
  judge(watch, sampleAt(10.0));
  ASSERT_TRUE(watch.started());
  for (int i = 0; i < 12; ++i) judge(watch, sampleAt(10.0 + 0.02 * i, 1e6, 1e6));
  EXPECT_EQ(after(watch, StopCause::none, 10.5), StopCause::none) << "on the model";
  EXPECT_EQ(watch.loss(), Loss::both_encoders);
  watch.restart(2.0);
  EXPECT_FALSE(watch.started());
  EXPECT_EQ(watch.loss(), Loss::none);
  EXPECT_TRUE(watch.recoversFromStall(2.1));
  EXPECT_EQ(after(watch, StopCause::imu_missing, 2.2), StopCause::imu_missing);
  EXPECT_FALSE(watch.started());
  judge(watch, sampleAt(2.3));
  EXPECT_EQ(after(watch, StopCause::wheels_late, 3.2), StopCause::none) << "seen 0.9 s ago";
  watch.reset();
  EXPECT_FALSE(watch.recoversFromStall(2.1));
}

TEST(MeasurementWatch, ChannelsOfLostSourcesAndImpossibleReadingsDoNotCount) {
  const struct {
    SensorHealth health;
    double wheel_left, yaw_rate, acceleration;
    ChannelValidity valid;
  } rows[] = {{kSound, 0.0, 0.0, 0.0, {}},
              {healthOf(StopCause::imu_frozen), 0.0, 0.0, 0.0, {false, true, true, false}},
              {healthOf(StopCause::wheels_late), 0.0, 0.0, 0.0, {true, false, false, true}},
              {kSound, -100.0, 19.0, 99.0, {}},
              {kSound, 200.0, 0.0, 0.0, {true, false, true, true}},
              {kSound, 0.0, -1e300, 0.0, {false, true, true, true}},
              {kSound, 0.0, 0.0, 101.0, {true, true, true, false}}};  // beyond ten times gravity
  for (const auto& row : rows) {
    for (const bool along : {true, false}) {
      MeasurementWatch watch(parameters(kDrive, kDrive, kDrive));
      Observation y = sampleAt(1.0, 0.0, row.yaw_rate);
      y.wheel_left = row.wheel_left;
      (along ? y.acceleration_x : y.acceleration_y) = row.acceleration;
      watch.judge(y, row.health, 1.0);
      EXPECT_EQ(y.valid, row.valid) << row.wheel_left << ", " << row.yaw_rate << ", " << row.acceleration;
    }
  }
}

TEST(MeasurementWatch, ImpossibleReadingsForTheirDeadlineAreALoss) {
  for (const double rate : {10.0, 20.0, 50.0, 100.0}) {
    MeasurementWatch watch(parameters(kDrive, kDrive, kStop));
    judge(watch, sampleAt(1.0));
    for (int i = 1; i <= std::lround(0.3 * rate); ++i) {
      judge(watch, sampleAt(1.0 + i / rate, 200.0));
      const bool lost = i / rate > 0.2 - 1e-9;
      EXPECT_EQ(after(watch), lost ? StopCause::sensor_fault : StopCause::none) << rate << " Hz, " << i;
    }
    judge(watch, sampleAt(2.0));
    EXPECT_EQ(after(watch), StopCause::none);
  }
  MeasurementWatch imu(parameters(kDrive, kStop, kStop));
  for (int i = 0; i < 10; ++i) judge(imu, sampleAt(1.0 + 0.025 * i, 0.0, 1e300));
  EXPECT_EQ(after(imu), StopCause::none);
  EXPECT_EQ(imu.loss(), Loss::yaw_rate);
  MeasurementWatch stamps(parameters(kDrive, kDrive, kStop));
  for (const double stamp : {1.0, std::nan(""), 1.04}) {
    Observation spike = sampleAt(stamp, 200.0);
    stamps.judge(spike, kSound, 1.0);
    EXPECT_EQ(after(stamps), StopCause::none) << "no time elapses to a stamp of " << stamp;
  }
}

/// A sample with one channel, in turn: none is missing for long.
Observation ofOneChannel(int i) {
  Observation sample = sampleAt(1.0 + 0.02 * i);
  sample.valid = {i % 3 == 2, i % 3 == 0, i % 3 == 1, true};
  return sample;
}

TEST(MeasurementWatch, TooFewChannelsAtATimeStop) {
  for (const bool with_model : {false, true}) {
    for (const bool reset : {false, true}) {
      MeasurementWatch watch(with_model ? monitored(kDrive, kDrive, kDrive) : parameters(kDrive, kDrive, kDrive));
      for (int i = 1; i <= 20; ++i) {
        judge(watch, ofOneChannel(i));
        EXPECT_EQ(after(watch, StopCause::none, 1.0 + 0.02 * i), i <= 16 ? StopCause::none : StopCause::sensor_fault)
            << i;
      }
      EXPECT_EQ(watch.loss(), Loss::unclear);
      if (reset) watch.reset();
      if (!reset) judge(watch, sampleAt(2.0));
      EXPECT_EQ(after(watch, StopCause::none, 2.0), StopCause::none);
    }
  }
}

TEST(MeasurementWatch, SourceThatComesBackCountsAtOnce) {
  const struct {
    MeasurementWatchParameters parameters;
    StopCause cause;
    double yaw_rate;  // of the samples meanwhile
  } rows[] = {{parameters(kDrive, kStop, kStop), StopCause::wheels_late, 0.0},
              {onModel(), StopCause::wheels_late, 0.0},
              {parameters(kDrive, kStop, kStop), StopCause::imu_late, 0.0},
              {parameters(kDrive, kDrive, kDrive), StopCause::imu_late, 1e3}};
  for (const auto& row : rows) {
    MeasurementWatch watch(row.parameters);
    judge(watch, sampleAt(1.0));
    for (int i = 1; i <= 65; ++i) {
      after(watch, row.cause, 1.0 + 0.02 * i);
      judge(watch, sampleAt(1.0 + 0.02 * i, 0.0, row.yaw_rate), healthOf(row.cause));
    }
    EXPECT_EQ(watch.loss() == Loss::yaw_rate, row.cause == StopCause::imu_late);
    EXPECT_EQ(after(watch, StopCause::none, 2.32), StopCause::none) << text(watch.loss());
    EXPECT_EQ(watch.loss(), Loss::none) << text(row.cause);
  }
}

TEST(MeasurementWatch, BothEncodersThatRepeatAreToleratedForThreeTenths) {
  MeasurementWatch watch(monitored(kDrive, kStop, kStop));
  int repeating = 0, tolerated = 0;
  StopCause cause = StopCause::none;
  for (int i = 1; i <= 200 && cause == StopCause::none; ++i) {
    const double noise = i <= 100 ? 0.01 * ((i * 7) % 11 - 5) : 0.0;
    Observation y = sampleAt(1.0 + 0.02 * i, 0.0, 0.001 * ((i * 5) % 7));
    y.wheel_left = 5.0 + noise;
    y.wheel_right = 5.0 - noise;
    y.acceleration_x = 0.01 * ((i * 3) % 5);
    judge(watch, y);
    watch.advance(WheelCommand{5.0, 5.0}, 0.02);
    cause = watch.causes(kSound, y.stamp, false).worst();
    const FaultReport& report = *watch.report();
    repeating += report.wheel_left.fault == Fault::left_encoder_frozen &&
                 report.wheel_right.fault == Fault::right_encoder_frozen;
    tolerated += repeating > 0 && cause == StopCause::none;
  }
  EXPECT_EQ(cause, StopCause::sensor_fault);
  EXPECT_EQ(tolerated, 15) << "in which deadlines.frozen_wheels decides";
}

constexpr ChannelValidity kNoGyro{false, true, true, true}, kNoLeft{true, false, true, true};

TEST(LossPolicy, OnABoxTheYawRateReplacesNoEncoder) {
  const LossPolicyParameters policy{kDrive, kDrive, kStop, 1.0};
  const LossDecision decision = decideOnLoss(policy, kNoLeft, 0.0, true);
  EXPECT_EQ(decision.loss, Loss::encoder_and_yaw_rate);
  EXPECT_EQ(decision.action, kStop);
  EXPECT_EQ(decideOnLoss(policy, kNoGyro, 0.0, true).action, kDrive);
}

}  // namespace
}  // namespace jackal_aic
