#include "jackal_aic/identification/plant_identification.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

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

TEST(PlantIdentification, FindsTheEffectiveTrackOfEachDirection) {
  const Identification found = identifyDriveTrain(record(plantWith(0.1, 0.05, 1.0, 10.0)), kRadius);
  ASSERT_TRUE(found.track_left.known() && found.track_right.known());
  EXPECT_NEAR(found.track_left.value, 0.547, 0.547 * 0.03);
  EXPECT_NEAR(found.track_right.value, 0.547, 0.547 * 0.03);
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
  EXPECT_NE(refusal(still).find("no excitation"), std::string::npos);

  DriveRecording reversed = good;
  std::swap(reversed.wheels[50], reversed.wheels[51]);
  EXPECT_NE(refusal(reversed).find("not monotonic"), std::string::npos);

  DriveRecording broken = good;
  broken.wheels[10].speed.left = std::nan("");
  EXPECT_NE(refusal(broken).find("not finite"), std::string::npos);

  DriveRecording short_one = good;
  short_one.wheels.resize(20);
  EXPECT_NE(refusal(short_one).find("wheel speeds: 20 samples"), std::string::npos);
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
