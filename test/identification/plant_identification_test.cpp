#include "jackal_aic/identification/plant_identification.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <random>
#include <string>
#include <tuple>
#include <utility>

#include "excitation.hpp"
#include "jackal_plant.hpp"
#include "plant/test_plant.hpp"

namespace jackal_aic {
namespace {

constexpr double kRadius = 0.098;

/// Drives the excitation on the simulated robot and records it as the topics would.
DriveRecording record(const sim::PlantParameters& parameters, const ExcitationParameters& bounds = {}) {
  sim::JackalPlant plant(sim::jackalUrdf(), parameters);
  const Excitation excitation(bounds, GeometryParameters{});
  DriveRecording recording;
  for (int k = 0; k < 1000 * excitation.duration(); ++k) {
    if (k % 20 == 7) {
      const WheelCommand command = excitation.at(plant.time());
      plant.command(command);
      recording.commands.push_back({plant.time(), command});
    }
    plant.step();
    if (!plant.measurement()) continue;
    const Observation y = plant.measurement()->observation();
    recording.wheels.push_back({y.stamp, {y.wheel_left, y.wheel_right}});
    recording.yaw.push_back({y.stamp, y.yaw_rate});
  }
  return recording;
}

sim::PlantParameters plantWith(double dead_time, double lag, double gain, double limit) {
  sim::PlantParameters parameters;
  parameters.dead_time = dead_time;
  parameters.motor_lag = lag;
  parameters.wheel_gain = gain;
  parameters.velocity_loop_integral = 0.0;
  parameters.acceleration_limit = limit;
  return parameters;
}

/// Message of the IdentificationError that identification throws, one line.
std::string refusal(const DriveRecording& recording) {
  try {
    identifyDriveTrain(recording, kRadius);
  } catch (const IdentificationError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  ADD_FAILURE() << "identified from a useless recording";
  return "";
}

TEST(PlantIdentification, FindsTheDriveTrainThroughTheNoise) {
  const Identification found = identifyDriveTrain(record(plantWith(0.12, 0.06, 0.9, 4.0)), kRadius);
  EXPECT_NEAR(found.dead_time.value, 0.12, 0.005);
  EXPECT_NEAR(found.lag.value, 0.06, 0.006);
  EXPECT_NEAR(found.gain.value, 0.9, 0.005);
  EXPECT_NEAR(found.acceleration_limit.value, 4.0, 0.3);
  EXPECT_TRUE(found.acceleration_limit.known());
  EXPECT_NEAR(found.residual, 0.03, 0.002) << "what remains is the noise of the encoders";
  EXPECT_LT(std::abs(found.lag.value - 0.06), 3 * found.lag.half_width + 0.002);
}

/// Robots whose lag was unknown, because the search had reached a lag with a vanishing derivative.
TEST(PlantIdentification, ALagTooShortToBeSeenIsKnownToBeShort) {
  for (const auto& [seed, lag] :
       {std::pair(14, 0.0), std::pair(16, 0.001), std::pair(18, 0.002), std::pair(20, 0.003)}) {
    SCOPED_TRACE(seed);
    sim::PlantParameters parameters = plantWith(0.08, lag, 1.0, 1.65);
    parameters.stamp_jitter = 0.002 * (seed % 3);
    parameters.encoder_noise = 0.03;
    parameters.seed = seed;
    const Identification found = identifyDriveTrain(record(parameters), kRadius);
    EXPECT_TRUE(found.lag.known()) << found.lag.value << " " << found.lag.unknown;
    EXPECT_LE(std::abs(found.lag.value - lag), found.lag.half_width);
    EXPECT_LT(found.lag.half_width, 0.02);
  }
}

TEST(PlantIdentification, FindsTheEffectiveTrackOfEachDirection) {
  const Identification found = identifyDriveTrain(record(plantWith(0.1, 0.05, 1.0, 10.0)), kRadius);
  ASSERT_TRUE(found.track_left.known() && found.track_right.known());
  EXPECT_NEAR(found.track_left.value, 0.547, 0.547 * 0.03);
  EXPECT_NEAR(found.track_right.value, 0.547, 0.547 * 0.03);
}

TEST(PlantIdentification, ImpossibleSpeedsAreRefusedWithTheirBound) {
  const DriveRecording good = record(plantWith(0.1, 0.05, 1.0, 10.0));
  DriveRecording wheels = good, turn = good, command = good;
  wheels.wheels[100].speed.left = 1e300;
  turn.yaw[100].yaw_rate = -2e3;
  command.commands[100].command.right = 3e38;
  EXPECT_EQ(refusal(wheels), "wheel speeds = 1e+300 rad/s at 2.020 s: must be within +-10000 rad/s");
  EXPECT_EQ(refusal(turn), "yaw rate = -2000 rad/s at 2.020 s: must be within +-1000 rad/s");
  EXPECT_EQ(refusal(command), "wheel commands = 3e+38 rad/s at 2.007 s: must be within +-10000 rad/s");
}

/// A bit that flips on a bus, or a counter that wraps.
TEST(PlantIdentification, ASpikeNowAndThenChangesLittle) {
  const sim::PlantParameters robot = plantWith(0.1, 0.05, 0.95, 3.0);
  const DriveRecording clean = record(robot);
  const Identification expected = identifyDriveTrain(clean, kRadius);
  for (const double spike : {4000.0, -60.0, 5.0}) {
    DriveRecording spiked = clean;
    for (const std::size_t at : {150, 151, 420, 700}) spiked.wheels[at].speed.right += spike;
    for (const std::size_t at : {300, 600}) spiked.yaw[at].yaw_rate += 0.1 * spike;
    const Identification found = identifyDriveTrain(spiked, kRadius);
    EXPECT_NEAR(found.dead_time.value, expected.dead_time.value, 1e-3) << spike;
    EXPECT_NEAR(found.lag.value, expected.lag.value, 3e-3) << spike;
    EXPECT_NEAR(found.gain.value, expected.gain.value, 1e-3) << spike;
    EXPECT_NEAR(found.track_left.value, expected.track_left.value, 1e-3) << spike;
    ASSERT_EQ(found.fitted.size(), spiked.wheels.size());
    ASSERT_GE(found.remarks.size(), 2u) << spike;
    // Next to two spikes in a row on a ramp, a third value may count as a spike.
    EXPECT_NE(found.remarks[0].find(" of 1680 wheel speeds left out"), std::string::npos) << found.remarks[0];
    EXPECT_NE(found.remarks[1].find("spikes: 2 of 840 yaw rates"), std::string::npos) << found.remarks[1];
  }
  for (const std::string& remark : expected.remarks) EXPECT_NE(remark.find("spikes"), 0u) << remark;
}

TEST(PlantIdentification, ASlowTurnIsNoBiasOfTheGyro) {
  DriveRecording recording = record(plantWith(0.1, 0.05, 1.0, 10.0));
  constexpr double kSlow = 0.12, kTrack = 0.547;  // rad/s of each wheel, m
  const double end = recording.wheels.back().time;
  for (int k = 1; k <= 500; ++k) {
    const double time = end + 0.02 * k;
    recording.commands.push_back({time, {-kSlow, kSlow}});
    recording.wheels.push_back({time, {-kSlow, kSlow}});
    recording.yaw.push_back({time, kRadius * 2.0 * kSlow / kTrack});
  }
  const Identification found = identifyDriveTrain(recording, kRadius);
  ASSERT_TRUE(found.track_left.known() && found.track_right.known());
  EXPECT_NEAR(found.track_left.value, found.track_right.value, 0.01 * kTrack);
}

TEST(PlantIdentification, SaysWhenTheAccelerationLimitWasNeverReached) {
  const Identification found = identifyDriveTrain(record(plantWith(0.1, 0.2, 1.0, 100.0)), kRadius);
  EXPECT_FALSE(found.acceleration_limit.known());
  EXPECT_GT(found.acceleration_limit.value, 1.0);
  EXPECT_NEAR(found.lag.value, 0.2, 0.02);
}

TEST(PlantIdentification, SeesClippedWheelsAndKeepsTheGain) {
  auto parameters = plantWith(0.1, 0.05, 1.0, 10.0);
  parameters.speed_limit = 0.45;
  const Identification found = identifyDriveTrain(record(parameters), kRadius);
  EXPECT_NEAR(found.gain.value, 1.0, 0.02);
  ASSERT_FALSE(found.remarks.empty());
  EXPECT_NE(found.remarks.front().find("clipped"), std::string::npos) << found.remarks.front();
}

TEST(PlantIdentification, SaysWhenTheRobotStoodOnBlocks) {
  auto parameters = plantWith(0.1, 0.05, 1.0, 10.0);
  parameters.support = sim::Support::box;
  const Identification found = identifyDriveTrain(record(parameters), kRadius);
  EXPECT_NEAR(found.dead_time.value, 0.1, 0.01);
  EXPECT_FALSE(found.track_left.known());
  EXPECT_NE(found.track_left.unknown.find("blocks"), std::string::npos);
}

TEST(PlantIdentification, SaysWhatAOneSidedRecordingLacks) {
  DriveRecording recording = record(plantWith(0.1, 0.05, 1.0, 10.0));
  // The first two pieces after the rest: half speed forward, rest.
  const double end = recording.commands.front().time + 2.7;
  const auto cut = [&](auto& series) {
    while (!series.empty() && series.back().time > end) series.pop_back();
  };
  cut(recording.commands);
  cut(recording.wheels);
  cut(recording.yaw);
  const Identification found = identifyDriveTrain(recording, kRadius);
  ASSERT_FALSE(found.remarks.empty());
  EXPECT_NE(found.remarks.front().find("one-sided"), std::string::npos);
  EXPECT_FALSE(found.track_left.known());
  EXPECT_NE(found.track_left.unknown.find("no turn to the left"), std::string::npos);
}

TEST(PlantIdentification, RefusesWhatCannotBeIdentified) {
  const DriveRecording good = record(plantWith(0.1, 0.05, 1.0, 10.0));
  EXPECT_NE(refusal({}).find("wheel commands: 0 samples"), std::string::npos);

  DriveRecording still = good;
  for (auto& sample : still.commands) sample.command = {};
  EXPECT_EQ(refusal(still), "wheel commands: no excitation (0 steps of 0.5 rad/s or more, at least 2 are needed)");
  DriveRecording left_still = good, right_still = good;
  for (auto& sample : left_still.commands) sample.command.left = 0.0;
  for (auto& sample : right_still.commands) sample.command.right = 0.3;
  EXPECT_NE(refusal(left_still).find("no excitation of the left wheels (0 steps"), std::string::npos);
  EXPECT_NE(refusal(right_still).find("no excitation of the right wheels (0 steps"), std::string::npos);

  DriveRecording reversed = good;
  std::swap(reversed.wheels[50], reversed.wheels[51]);
  EXPECT_NE(refusal(reversed).find("not monotonic"), std::string::npos);

  DriveRecording broken = good;
  broken.wheels[10].speed.left = std::nan("");
  EXPECT_EQ(refusal(broken), "wheel speeds at 0.220 s: a value is not finite");

  DriveRecording apart = good;
  for (auto& sample : apart.wheels) sample.time += 3600.0;
  EXPECT_EQ(refusal(apart).rfind("wheel speeds and commands do not overlap in time (3600.020 to ", 0), 0U)
      << refusal(apart);

  DriveRecording short_one = good;
  short_one.wheels.resize(20);
  EXPECT_NE(refusal(short_one).find("wheel speeds: 20 samples"), std::string::npos);
}

/// A recording of a known drive train without the simulated robot: commands and samples at rates of their own.
struct Drive {
  double dead_time = 0.1, lag = 0.05, gain = 1.0, limit = 10.0;  // s, s, -, m/s^2
  double offset = 0.0;                                           // rad/s, also the command below which nothing turns
  double track = 0.6;                                            // m
  double wheel_rate = 50.0, imu_rate = 50.0;                     // Hz
  double imu_stamp = 0.0;                                        // s, later than that of the wheels
  double duration = 20.0;                                        // s
  double noise = 0.03;                                           // rad/s
  double right_gain = 1.0, backward_gain = 1.0;                  // times gain, of wheels on the right, and backward
  double right_later = 0.0;                                      // s, dead time of the right more than that of the left
  double hold = 0.0;                                             // s, between two measurements of the wheels
};

/// Steps of 0.8 s, drawn at random, turns included.
DriveRecording record(const Drive& drive) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> speed(-8.0, 8.0);
  DriveRecording recording;
  const auto target = [&](double u, double gain) {
    const double of_direction = u < 0.0 ? gain * drive.backward_gain : gain;
    return std::copysign(std::max(0.0, of_direction * std::abs(u) - drive.offset), u);
  };
  const auto applied = [&](double time) {
    WheelCommand command;
    for (auto c = recording.commands.rbegin(); c != recording.commands.rend(); ++c) {
      if (c->time <= time) return c->command;
    }
    return command;
  };
  WheelVector wheels = WheelVector::Zero();
  WheelCommand command, measured;
  const auto due = [](int k, double rate) { return std::floor(k * 1e-3 * rate) != std::floor((k - 1) * 1e-3 * rate); };
  for (int k = 0; k < 1000 * drive.duration; ++k) {
    const double time = k * 1e-3;
    if (k % 800 == 0 && k > 0) command = {speed(random), speed(random)};
    if (k % 20 == 0) recording.commands.push_back({time, command});
    const double left = applied(time - drive.dead_time).left;
    const double right = applied(time - drive.dead_time - drive.right_later).right;
    const double left_target = target(left, drive.gain), right_target = target(right, drive.gain * drive.right_gain);
    const double largest = 1e-3 * drive.limit / kRadius;
    for (auto [w, asked] : {std::pair<double&, double>{wheels(0), left_target}, {wheels(1), right_target}}) {
      w += std::clamp((1.0 - std::exp(-1e-3 / drive.lag)) * (asked - w), -largest, largest);
    }
    if (due(k, drive.hold > 0.0 ? 1.0 / drive.hold : drive.wheel_rate)) {
      measured = {wheels(0) + drive.noise * normal(random), wheels(1) + drive.noise * normal(random)};
    }
    if (due(k, drive.wheel_rate)) recording.wheels.push_back({time + 1e-3, measured});
    if (due(k, drive.imu_rate)) {
      recording.yaw.push_back({time + 1e-3 + drive.imu_stamp, kRadius * (wheels(1) - wheels(0)) / drive.track});
    }
  }
  return recording;
}

TEST(PlantIdentification, RefusesWheelsThatNeverTurn) {
  DriveRecording recording = record(Drive{});
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.03);
  for (auto& sample : recording.wheels) sample.speed = {noise(random), noise(random)};
  EXPECT_NE(refusal(recording).find("the wheels never turn"), std::string::npos);
  recording = record(Drive{});
  for (auto& sample : recording.wheels) sample.speed.right = 0.0;
  EXPECT_NE(refusal(recording).find("the right wheels never turn"), std::string::npos);
}

TEST(PlantIdentification, RefusesInvertedAndExchangedWheels) {
  const DriveRecording good = record(Drive{});
  DriveRecording inverted = good;
  for (auto& sample : inverted.commands) sample.command = {-sample.command.left, -sample.command.right};
  EXPECT_NE(refusal(inverted).find("the wheels turn against their commands"), std::string::npos);
  inverted = good;
  for (auto& sample : inverted.wheels) sample.speed.left = -sample.speed.left;
  EXPECT_NE(refusal(inverted).find("the left wheels turn against"), std::string::npos);
  DriveRecording exchanged = good;
  for (auto& sample : exchanged.wheels) std::swap(sample.speed.left, sample.speed.right);
  EXPECT_NE(refusal(exchanged).find("left and right are exchanged"), std::string::npos);
}

TEST(PlantIdentification, RefusesWheelsThatDoNotFollowTheseCommands) {
  DriveRecording other = record(Drive{});
  std::mt19937 random(3);
  WheelVector walk = WheelVector::Zero();
  std::normal_distribution<double> step(0.0, 0.5);
  for (auto& sample : other.wheels) {
    walk = 0.99 * walk + WheelVector{step(random), step(random)};
    sample.speed = {walk(0), walk(1)};
  }
  refusal(other);
}

TEST(PlantIdentification, RefusesWheelsThatAnswerBeforeTheirCommands) {
  DriveRecording early = record(Drive{});
  for (auto& sample : early.wheels) sample.time -= 0.15;
  EXPECT_NE(refusal(early).find("the wheels answer before their commands"), std::string::npos);
}

TEST(PlantIdentification, RefusesEstimatesAtTheEndOfTheRange) {
  Drive drive;
  drive.dead_time = 0.55;
  EXPECT_NE(refusal(record(drive)).find("dead time: the estimate is at the end of the range"), std::string::npos);
}

TEST(PlantIdentification, ModelsTheOffsetOfTheMotors) {
  Drive drive;
  drive.offset = 0.5;
  drive.gain = 0.95;
  const Identification found = identifyDriveTrain(record(drive), kRadius);
  EXPECT_NEAR(found.gain.value, 0.95, 0.005);
  EXPECT_NEAR(found.offset.value, 0.5, 0.03);
  EXPECT_NE(std::count_if(found.remarks.begin(), found.remarks.end(),
                          [](const std::string& remark) { return remark.rfind("offset: ", 0) == 0; }),
            0);
  EXPECT_GT(found.r_squared, 0.999);
}

TEST(PlantIdentification, CutsGaps) {
  DriveRecording recording = record(Drive{});
  const auto part = [](auto& series) {
    series.erase(std::remove_if(series.begin(), series.end(),
                                [](const auto& sample) { return sample.time > 9.0 && sample.time < 10.3; }),
                 series.end());
    for (auto& sample : series) {
      if (sample.time > 9.5) sample.time += 3600.0;
    }
  };
  part(recording.commands);
  part(recording.wheels);
  part(recording.yaw);
  const Identification found = identifyDriveTrain(recording, kRadius);
  EXPECT_NEAR(found.dead_time.value, 0.1, 0.005);
  ASSERT_FALSE(found.remarks.empty());
  EXPECT_EQ(found.remarks.front().rfind("cut: 1 gap of more than 0.5 s", 0), 0U) << found.remarks.front();
}

TEST(PlantIdentification, CutsWhatTheCommandsDoNotExplain) {
  DriveRecording recording = record(Drive{});
  for (auto& sample : recording.wheels) {
    if (sample.time > 8.0 && sample.time < 12.0) sample.speed = {-6.0, 6.0};
  }
  const Identification found = identifyDriveTrain(recording, kRadius);
  EXPECT_NEAR(found.dead_time.value, 0.1, 0.005);
  EXPECT_NEAR(found.gain.value, 1.0, 0.005);
  EXPECT_GT(found.r_squared, 0.99);
  ASSERT_FALSE(found.remarks.empty());
  EXPECT_NE(found.remarks.front().find("commands do not explain"), std::string::npos) << found.remarks.front();
}

TEST(PlantIdentification, TakesTheImuAtOtherTimesThanTheWheels) {
  for (const double late : {0.003, -0.003, 0.009}) {
    for (const double imu_rate : {20.0, 50.0, 80.0}) {
      for (const double wheel_rate : {20.0, 50.0}) {
        Drive drive;
        drive.imu_stamp = late;
        drive.imu_rate = imu_rate;
        drive.wheel_rate = wheel_rate;
        const Identification found = identifyDriveTrain(record(drive), kRadius);
        ASSERT_TRUE(found.track_left.known()) << found.track_left.unknown;
        ASSERT_TRUE(found.track_right.known()) << found.track_right.unknown;
        EXPECT_NEAR(found.track_left.value, 0.6, 0.03) << late << " " << imu_rate << " " << wheel_rate;
        EXPECT_NEAR(found.track_right.value, 0.6, 0.03) << late << " " << imu_rate << " " << wheel_rate;
        EXPECT_NEAR(found.dead_time.value, 0.1, 0.01);
      }
    }
  }
}

TEST(PlantIdentification, SaysWhenTheGyroIsUpsideDown) {
  DriveRecording recording = record(Drive{});
  for (auto& sample : recording.yaw) sample.yaw_rate = -sample.yaw_rate;
  const Identification found = identifyDriveTrain(recording, kRadius);
  EXPECT_NE(found.track_left.unknown.find("upside down"), std::string::npos);
}

TEST(PlantIdentification, AGyroOfAnotherUnitOrScaleGivesNoTrack) {
  for (const auto& [scale, track] : {std::pair(180.0 / M_PI, 0.01047), std::pair(0.2, 3.0)}) {
    DriveRecording recording = record(Drive{});
    for (auto& sample : recording.yaw) sample.yaw_rate *= scale;
    const Identification found = identifyDriveTrain(recording, kRadius);
    for (const Estimate* side : {&found.track_left, &found.track_right}) {
      EXPECT_NEAR(std::atof(side->unknown.c_str()), track, 0.01 * track) << side->unknown;
      EXPECT_NE(side->unknown.find(" m, must be within 0.196 to 1.96 m"), std::string::npos) << side->unknown;
    }
  }
}

TEST(PlantIdentification, SaysWhyThereIsNoTrack) {
  const DriveRecording good = record(Drive{});
  DriveRecording apart = good, gone = good, far = good;
  for (auto& sample : apart.yaw) sample.time += 100.0;
  EXPECT_EQ(identifyDriveTrain(apart, kRadius).track_left.unknown.rfind("wheel speeds and IMU data do not overlap", 0),
            0U);
  gone.yaw.clear();
  gone.yaw_unknown = "its mounting is unknown";
  EXPECT_EQ(identifyDriveTrain(gone, kRadius).track_left.unknown, gone.yaw_unknown);
  far.yaw = {good.yaw.front(), good.yaw.back()};
  EXPECT_EQ(identifyDriveTrain(far, kRadius).track_left.unknown.rfind("no IMU data within", 0), 0U);
}

bool covers(const Estimate& estimate, double truth) {
  return estimate.known() && std::abs(estimate.value - truth) <= estimate.half_width;
}

/// Whether there is a remark that begins so.
bool remarked(const Identification& found, const std::string& text) {
  return std::any_of(found.remarks.begin(), found.remarks.end(),
                     [&](const std::string& remark) { return remark.rfind(text, 0) == 0; });
}

TEST(PlantIdentification, IntervalsCoverSidesThatDiffer) {
  Drive drive;
  drive.right_gain = 0.8;
  Identification found = identifyDriveTrain(record(drive), kRadius);
  EXPECT_TRUE(remarked(found, "left and right differ: gain 1.00"));
  EXPECT_TRUE(covers(found.gain, 1.0) && covers(found.gain, 0.8)) << found.gain.value << " " << found.gain.half_width;
  drive = Drive{};
  drive.right_later = 0.1;
  found = identifyDriveTrain(record(drive), kRadius);
  EXPECT_TRUE(remarked(found, "left and right differ: dead time 0.10"));
  EXPECT_TRUE(covers(found.dead_time, drive.dead_time) && covers(found.dead_time, drive.dead_time + drive.right_later))
      << found.dead_time.value << " " << found.dead_time.half_width;
}

TEST(PlantIdentification, IntervalsCoverDirectionsThatDifferWhichAreNoOffset) {
  Drive drive;
  drive.backward_gain = 0.8;
  const Identification found = identifyDriveTrain(record(drive), kRadius);
  EXPECT_TRUE(remarked(found, "forward and backward differ: gain 1.0") ||
              remarked(found, "forward and backward differ: gain 0.99"));
  EXPECT_TRUE(covers(found.gain, 1.0) && covers(found.gain, 0.8)) << found.gain.value << " " << found.gain.half_width;
  EXPECT_FALSE(found.offset.known());
  EXPECT_FALSE(remarked(found, "offset: "));
}

TEST(PlantIdentification, EqualSidesAndDirectionsAreNotRemarkedOn) {
  for (const double offset : {0.0, 0.5}) {
    Drive drive;
    drive.offset = offset;
    const Identification found = identifyDriveTrain(record(drive), kRadius);
    EXPECT_FALSE(remarked(found, "left and right differ") || remarked(found, "forward and backward differ")) << offset;
    EXPECT_TRUE(covers(found.offset, offset)) << found.offset.value;
  }
}

TEST(PlantIdentification, EstimatesTheRateOfTheSensors) {
  for (const auto& [wheels, imu, rate] :
       {std::tuple(20.0, 80.0, 20.0), std::tuple(80.0, 50.0, 50.0), std::tuple(80.0, 80.0, 80.0),
        std::tuple(33.3, 50.0, 34.0), std::tuple(10.0, 50.0, 10.0), std::tuple(125.0, 200.0, 125.0)}) {
    Drive drive;
    drive.wheel_rate = wheels;
    drive.imu_rate = imu;
    EXPECT_EQ(identifyDriveTrain(record(drive), kRadius).sensor_rate, rate) << wheels << " " << imu;
  }
}

TEST(PlantIdentification, AHeldWheelSpeedIsOneMeasurement) {
  for (const auto& [rate, hold] : {std::pair(50.0, 0.1), std::pair(20.0, 0.1), std::pair(50.0, 0.07)}) {
    Drive drive;
    drive.wheel_rate = rate;
    drive.hold = hold;
    const Identification found = identifyDriveTrain(record(drive), kRadius);
    SCOPED_TRACE(std::to_string(rate) + " Hz, held " + std::to_string(hold) + " s");
    EXPECT_TRUE(
        remarked(found, "held: the wheel speeds are renewed every 0." + std::to_string(std::lround(1e3 * hold) / 100)));
    EXPECT_TRUE(covers(found.dead_time, drive.dead_time)) << found.dead_time.value << " " << found.dead_time.half_width;
    EXPECT_TRUE(covers(found.lag, drive.lag)) << found.lag.value << " " << found.lag.half_width;
    // One in twenty misses by chance, this by the last digit.
    EXPECT_LE(std::abs(found.gain.value - drive.gain), found.gain.half_width + 0.001);
    EXPECT_EQ(found.sensor_rate, rate);
  }
  Drive slow;
  slow.wheel_rate = 20.0;
  slow.hold = 0.25;
  EXPECT_EQ(refusal(record(slow)).rfind("the wheel speeds are renewed every 0.250 s only", 0), 0U);
}

/// What repeats because it is coarse is not held.
TEST(PlantIdentification, CoarseEncodersAreNotHeld) {
  for (const double step : {0.0065, 0.1, 0.3}) {
    for (const double noise : {0.0, 0.03}) {
      auto parameters = plantWith(0.1, 0.1, 1.0, 1.65);
      parameters.encoder_step = step;
      parameters.encoder_noise = noise;
      const Identification found = identifyDriveTrain(record(parameters), kRadius);
      EXPECT_FALSE(remarked(found, "held")) << step << " " << noise;
      EXPECT_EQ(found.sensor_rate, 50.0);
    }
  }
}

TEST(PlantIdentification, TakesTenMinutesInSeconds) {
  Drive drive;
  drive.duration = 600.0;
  const DriveRecording recording = record(drive);
  const std::clock_t start = std::clock();
  const Identification found = identifyDriveTrain(recording, kRadius);
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  EXPECT_NEAR(found.dead_time.value, 0.1, 0.002);
  // 1 s of the processor without sanitizers; the bound is for them.
  EXPECT_LT(seconds, 30.0);
  std::printf("%zu wheel samples: %.2f s\n", recording.wheels.size(), seconds);
}

TEST(Excitation, StaysWithinItsBoundsAndEndsAtRest) {
  const ExcitationParameters bounds{0.4, 0.8, 1.0, 0.5, 1};
  const Excitation excitation(bounds, GeometryParameters{});
  const SkidSteerKinematics kinematics{GeometryParameters{}};
  double forward = 0.0, backward = 0.0, left = 0.0, right = 0.0;
  for (double t = 0.0; t < excitation.duration(); t += 0.01) {
    const BodyVector body = kinematics.bodyVelocity(excitation.at(t));
    forward = std::max(forward, body(kForward));
    backward = std::min(backward, body(kForward));
    left = std::max(left, body(kYaw));
    right = std::min(right, body(kYaw));
  }
  EXPECT_NEAR(forward, 0.4, 1e-12);
  EXPECT_NEAR(backward, -0.4, 1e-12);
  EXPECT_NEAR(left, 0.8, 1e-12);
  EXPECT_NEAR(right, -0.8, 1e-12);
  EXPECT_EQ(excitation.at(excitation.duration() + 1.0), WheelCommand{});
  EXPECT_EQ(excitation.at(0.0), WheelCommand{});
}

}  // namespace
}  // namespace jackal_aic
