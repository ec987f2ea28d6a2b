#include "sensors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>
#include <utility>

#include "periodic.hpp"

namespace jackal_aic::sim {
namespace {

PlantTruth truth() {
  PlantTruth t;
  t.time = 1.5;
  t.wheel_position = {1.0, 2.0, 1.1, 2.1};
  t.wheel_velocity = {3.0, 4.0, 3.1, 4.1};
  return t;
}

SensorInput input() {
  return {{0.1, 0.2, 0.3, 0.4}, {0.01, 0.02, 0.5}, {1.0, 2.0, 9.81}, Eigen::Quaterniond::Identity()};
}

/// A sample of wheels and IMU.
template <class Sensors>
PlantMeasurement sampleOf(Sensors&& sensors, const PlantTruth& at = truth()) {
  PlantMeasurement sample;
  static_cast<WheelFeedback&>(sample) = sensors.wheels(at, input());
  static_cast<ImuMeasurement&>(sample) = sensors.imu(at, input());
  return sample;
}

using Channel = double (*)(const PlantMeasurement&);

/// Mean and standard deviation of a channel over many samples.
std::pair<double, double> statisticsOf(const PlantParameters& parameters, PlantTruth at, Channel channel) {
  SensorModel sensors(parameters);
  Eigen::ArrayXd values(20000);
  for (int n = 0; n < values.size(); ++n) {
    at.time = 0.02 * n;
    values(n) = channel(sampleOf(sensors, at));
  }
  return {values.mean(), std::sqrt((values - values.mean()).square().mean())};
}

TEST(Sensors, WithoutNoiseAreTheTruthAndRearEncodersCopyTheFrontOnes) {
  PlantParameters parameters;
  parameters.noise_scale = 0.0;
  const PlantMeasurement sample = sampleOf(SensorModel(parameters));
  EXPECT_EQ(sample.stamp, 1.5);
  EXPECT_EQ(sample.wheel_velocity, (std::array<double, 4>{3.0, 4.0, 3.0, 4.0}));
  EXPECT_EQ(sample.wheel_position, (std::array<double, 4>{1.0, 2.0, 1.0, 2.0}));
  EXPECT_EQ(sample.wheel_effort[kRearRight], 0.4);
  EXPECT_EQ(sample.angular_velocity, input().angular_velocity);
  EXPECT_EQ(sample.linear_acceleration, input().specific_force);
  const Observation observation = sample.observation();
  EXPECT_EQ(observation.stamp, 1.5);
  SensorVector expected;
  expected << 0.5, 3.0, 4.0, 1.0, 2.0;
  EXPECT_EQ(observation.vector(), expected);
  const PlantMeasurement noisy = sampleOf(SensorModel(PlantParameters{}));
  EXPECT_EQ(noisy.wheel_velocity[kRearLeft], noisy.wheel_velocity[kFrontLeft]);
  EXPECT_EQ(noisy.wheel_velocity[kRearRight], noisy.wheel_velocity[kFrontRight]);
  EXPECT_NE(noisy.wheel_velocity[kFrontLeft] - 3.0, noisy.wheel_velocity[kFrontRight] - 4.0);
}

constexpr Channel kRightWheel = [](const PlantMeasurement& m) { return m.wheel_velocity[kFrontRight]; };
constexpr Channel kGyro = [](const PlantMeasurement& m) { return m.angular_velocity.z(); };
constexpr Channel kAlong = [](const PlantMeasurement& m) { return m.linear_acceleration.x(); };
constexpr Channel kAcross = [](const PlantMeasurement& m) { return m.linear_acceleration.y(); };
constexpr Channel kUp = [](const PlantMeasurement& m) { return m.linear_acceleration.z(); };

TEST(Sensors, NoiseHasTheStatedDeviationAndNoBias) {
  PlantParameters parameters;
  parameters.noise_scale = 2.0;
  for (const auto& [channel, truly, stated, tolerance] :
       {std::tuple{kRightWheel, 4.0, 0.06, 0.002}, {kGyro, 0.5, 0.01, 0.0003}, {kAcross, 2.0, 0.1, 0.003}}) {
    const auto [mean, deviation] = statisticsOf(parameters, truth(), channel);
    EXPECT_NEAR(mean, truly, tolerance);
    EXPECT_NEAR(deviation, stated, tolerance);
  }
}

TEST(Sensors, VibrationGrowsWithTheSpeedOfTheWheels) {
  PlantParameters parameters;
  parameters.gyro_noise = parameters.accelerometer_noise = 0.0;
  parameters.vibration_x = 2.07;
  parameters.vibration_z = 0.93;
  parameters.vibration_gyro = 0.019;
  for (const auto& [speed, channel, stated] : {std::tuple{0.0, kAlong, 0.0},
                                               {1.0, kAlong, 2.07},
                                               {-0.5, kAlong, 1.035},
                                               {1.0, kAcross, 0.0},
                                               {1.0, kUp, 0.93},
                                               {1.0, kGyro, 0.019}}) {
    PlantTruth moving = truth();
    moving.wheel_velocity.fill(speed / 0.098);  // m/s of the circumference
    EXPECT_NEAR(statisticsOf(parameters, moving, channel).second, stated, 0.03 * stated + 1e-12) << speed;
  }
}

TEST(Sensors, SeedDecidesTheNoiseWhateverIsLost) {
  PlantParameters one, other, lossy;
  other.seed = 2;
  lossy.measurement_loss = 0.5;
  SensorModel a(one), b(one), c(other), losing(lossy);
  for (int n = 0; n < 20; ++n) {
    const PlantMeasurement sample = sampleOf(a);
    EXPECT_EQ(sample.wheel_velocity, sampleOf(b).wheel_velocity);
    EXPECT_NE(sample.wheel_velocity, sampleOf(c).wheel_velocity);
    EXPECT_EQ(sample.wheel_velocity, sampleOf(losing).wheel_velocity);
    losing.losesSample();
  }
}

TEST(Sensors, LoseAndRepeatTheStatedShareAndNeverTheFirst) {
  for (const double share : {0.1, 1.0}) {
    PlantParameters parameters;
    parameters.measurement_loss = parameters.feedback_repeats = share;
    SensorModel sensors(parameters);
    EXPECT_FALSE(sensors.losesSample());
    EXPECT_FALSE(sensors.repeatsFeedback());
    int lost = 0, repeated = 0;
    for (int n = 0; n < 20000; ++n) {
      lost += sensors.losesSample();
      repeated += sensors.repeatsFeedback();
    }
    EXPECT_NEAR(lost / 20000.0, share, 0.01);
    EXPECT_NEAR(repeated / 20000.0, share, 0.01);
  }
}

TEST(Sensors, RoundTheNoisyWheelSpeedToWholeSteps) {
  PlantParameters parameters;
  parameters.encoder_step = 0.0606;
  SensorModel sensors(parameters);
  bool changes = false;
  for (int n = 0; n < 100; ++n) {
    const double steps = sampleOf(sensors).wheel_velocity[kFrontLeft] / 0.0606;
    EXPECT_NEAR(steps, std::round(steps), 1e-9);
    EXPECT_NEAR(steps, 3.0 / 0.0606, 3.0);
    changes = changes || std::round(steps) != std::round(3.0 / 0.0606);
  }
  EXPECT_TRUE(changes);

  parameters.encoder_noise = 0.003;
  SensorModel quiet(parameters);
  const double first = sampleOf(quiet).wheel_velocity[kFrontRight];
  for (int n = 0; n < 100; ++n) EXPECT_EQ(sampleOf(quiet).wheel_velocity[kFrontRight], first);
}

TEST(SampleQueue, DeliversInOrderWithTheTimeOfArrival) {
  SampleQueue queue;
  PlantMeasurement sample;
  sample.wheel_velocity = {1.0, 1.0, 1.0, 1.0};
  queue.send(sample, 0.0305);
  sample.wheel_velocity = {2.0, 2.0, 2.0, 2.0};
  queue.send(sample, 0.021);
  EXPECT_FALSE(queue.receive(0.030).has_value());
  const auto first = queue.receive(0.031), second = queue.receive(0.032);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->stamp, 0.031);
  EXPECT_EQ(first->wheel_velocity[0], 1.0);
  EXPECT_EQ(second->stamp, 0.032);
  EXPECT_EQ(second->wheel_velocity[0], 2.0);
  EXPECT_FALSE(queue.receive(0.033).has_value());
}

}  // namespace
}  // namespace jackal_aic::sim
