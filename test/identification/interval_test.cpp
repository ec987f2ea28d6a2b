// Whether the 95 % intervals of the identification hold what they say, over random robots with sensors as real ones
// are. JACKAL_AIC_INTERVAL_TRIALS says over how many robots (default 200).

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <random>
#include <string>

#include "../excitation.hpp"
#include "jackal_aic/identification/plant_identification.hpp"
#include "jackal_plant.hpp"
#include "plant/test_plant.hpp"

namespace jackal_aic {
namespace {

constexpr double kRadius = 0.098;
constexpr int kTellingTrials = 30;  // in which a quantity is known; of fewer, chance decides its share

int trials() {
  const char* text = std::getenv("JACKAL_AIC_INTERVAL_TRIALS");
  return text == nullptr ? 200 : std::max(1, std::atoi(text));
}

/// A robot, how its sensors reach a recording, and by how much its wheels turn slower than commanded.
struct Robot {
  sim::PlantParameters plant;
  double offset = 0.0;         // rad/s
  double network_delay = 0.0;  // s, longest by which a command comes late, at random; half of it is dead time
  double imu_late = 0.0;       // s, stamps of the IMU behind those of the wheels
};

Robot randomRobot(std::mt19937& random) {
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto oneOf = [&](std::initializer_list<double> values) { return values.begin()[random() % values.size()]; };
  Robot robot;
  robot.plant.dead_time = std::round(1000 * between(0.03, 0.20)) / 1000;
  robot.plant.motor_lag = between(0.02, 0.15);
  robot.plant.wheel_gain = between(0.8, 1.2);
  robot.plant.velocity_loop_integral = 0.0;
  robot.plant.acceleration_limit = between(1.5, 20.0);
  robot.plant.friction = between(0.3, 1.0);
  robot.plant.encoder_step = oneOf({0.0, 0.0065, 0.06, 0.1});
  robot.plant.stamp_jitter = oneOf({0.0, 0.004, 0.008});
  robot.plant.gyro_noise = between(0.005, 0.02);
  robot.plant.accelerometer_noise = between(0.05, 2.0);
  robot.plant.measurement_loss = oneOf({0.0, 0.02});
  robot.plant.sensor_rate = oneOf({20.0, 50.0, 80.0});
  robot.plant.seed = static_cast<int>(random() % 100000);
  robot.offset = oneOf({0.0, 0.5});
  robot.network_delay = oneOf({0.0, 0.01, 0.02});
  robot.imu_late = between(-0.005, 0.005);
  return robot;
}

/// The excitation of identify.launch, recorded.
DriveRecording record(const Robot& robot, std::mt19937& random) {
  sim::JackalPlant plant(sim::jackalUrdf(), robot.plant);
  ExcitationParameters bounds;
  const Excitation excitation(bounds, GeometryParameters{});
  std::uniform_real_distribution<double> share(0.0, 1.0);
  DriveRecording recording;
  std::multimap<int, WheelCommand> under_way;  // by step
  // What an offset o does to a command is that of a command by o / gain smaller.
  const auto smaller = [&](double u) {
    return std::copysign(std::max(0.0, std::abs(u) - robot.offset / robot.plant.wheel_gain), u);
  };
  int last = 0;
  for (int k = 0; k < 1000 * excitation.duration(); ++k) {
    if (k % 20 == 7) {
      const WheelCommand command = excitation.at(plant.time());
      recording.commands.push_back({plant.time(), command});
      last = std::max(last, k + static_cast<int>(std::lround(1000 * robot.network_delay * share(random))));
      under_way.emplace(last, WheelCommand{smaller(command.left), smaller(command.right)});
    }
    for (auto due = under_way.begin(); due != under_way.end() && due->first <= k; due = under_way.erase(due)) {
      plant.command(due->second);
    }
    plant.step();
    if (!plant.measurement()) continue;
    const Observation y = plant.measurement()->observation();
    recording.wheels.push_back({y.stamp, {y.wheel_left, y.wheel_right}});
    recording.yaw.push_back({y.stamp + robot.imu_late, y.yaw_rate});
  }
  return recording;
}

/// Effective track from ground truth, turning in place at the fastest turn of the excitation.
double trueTrack(Robot robot) {
  robot.plant.noise_scale = 0.0;
  robot.plant.encoder_step = robot.plant.stamp_jitter = 0.0;
  sim::JackalPlant plant(sim::jackalUrdf(), robot.plant);
  plant.command(SkidSteerKinematics(GeometryParameters{}).wheelSpeeds(0.0, ExcitationParameters{}.angular_speed));
  for (int k = 0; k < 3000; ++k) plant.step();
  const auto& truth = plant.truth();
  const double difference = 0.5 * (truth.wheel_velocity[sim::kFrontRight] + truth.wheel_velocity[sim::kRearRight] -
                                   truth.wheel_velocity[sim::kFrontLeft] - truth.wheel_velocity[sim::kRearLeft]);
  return kRadius * difference / truth.angular_velocity.z();
}

/// How often the truth lies in the interval, of the recordings that tell the quantity.
struct Coverage {
  int inside = 0, known = 0;
  double width = 0.0;  // sum of the half widths
  void add(const Estimate& estimate, double truth) {
    if (!estimate.known()) return;
    ++known;
    inside += std::abs(estimate.value - truth) <= estimate.half_width ? 1 : 0;
    width += estimate.half_width;
  }
  double share() const { return static_cast<double>(inside) / known; }
};

TEST(IdentificationIntervals, HoldTheTruthNineteenTimesOfTwenty) {
  std::mt19937 random(2022);
  std::map<std::string, Coverage> coverage;
  for (int trial = 0; trial < trials(); ++trial) {
    const Robot robot = randomRobot(random);
    const Identification found = identifyDriveTrain(record(robot, random), kRadius);
    // A command's way through the network and a sample's lateness are dead time, too; a late sample comes with the next
    // step of the simulation.
    const double late = robot.plant.stamp_jitter > 0.0 ? 0.5 * (robot.plant.stamp_jitter + 0.001) : 0.0;
    const double dead_time = robot.plant.dead_time + 0.5 * robot.network_delay + late;
    coverage["dead time"].add(found.dead_time, dead_time);
    coverage["lag"].add(found.lag, robot.plant.motor_lag);
    coverage["gain"].add(found.gain, robot.plant.wheel_gain);
    coverage["offset"].add(found.offset, robot.offset);
    coverage["acceleration limit"].add(found.acceleration_limit, robot.plant.acceleration_limit);
    const double track = trueTrack(robot);
    coverage["track, left"].add(found.track_left, track);
    coverage["track, right"].add(found.track_right, track);
  }
  Coverage all;
  for (const auto& [name, c] : coverage) {
    std::printf("%-20s %3d of %3d in the interval (%.1f %%), mean half width %.4f\n", name.c_str(), c.inside, c.known,
                100 * c.share(), c.width / c.known);
    if (c.known >= kTellingTrials) EXPECT_GE(c.share(), 0.90) << name;
    all.inside += c.inside;
    all.known += c.known;
  }
  std::printf("%-20s %3d of %3d (%.1f %%)\n", "all", all.inside, all.known, 100 * all.share());
  EXPECT_GE(coverage["acceleration limit"].known, trials() / 8);
  EXPECT_GE(all.share(), 0.90);
  EXPECT_LE(all.share(), 0.99);
}

}  // namespace
}  // namespace jackal_aic
