#include "jackal_aic/identification/plant_identification.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <random>
#include <string>
#include <tuple>
#include <utility>

#include "../complaint.hpp"
#include "../excitation.hpp"
#include "jackal_plant.hpp"
#include "plant/test_plant.hpp"

namespace jackal_aic {
namespace {

constexpr double kRadius = 0.098;

Identification identify(const DriveRecording& recording) { return identifyDriveTrain(recording, kRadius); }

/// The excitation on the simulated robot, recorded as the topics would.
DriveRecording record(const sim::PlantParameters& parameters) {
  sim::JackalPlant plant(sim::jackalUrdf(), parameters);
  const Excitation excitation(ExcitationParameters{}, GeometryParameters{});
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
    for (auto c = recording.commands.rbegin(); c != recording.commands.rend(); ++c) {
      if (c->time <= time) return c->command;
    }
    return WheelCommand{};
  };
  WheelVector wheels = WheelVector::Zero();
  WheelCommand command, measured;
  const auto due = [](int k, double rate) { return std::floor(k * 1e-3 * rate) != std::floor((k - 1) * 1e-3 * rate); };
  for (int k = 0; k < 1000 * drive.duration; ++k) {
    const double time = k * 1e-3;
    if (k % 800 == 0 && k > 0) command = {speed(random), speed(random)};
    if (k % 20 == 0) recording.commands.push_back({time, command});
    const double left = target(applied(time - drive.dead_time).left, drive.gain);
    const double right =
        target(applied(time - drive.dead_time - drive.right_later).right, drive.gain * drive.right_gain);
    const double largest = 1e-3 * drive.limit / kRadius;
    for (auto [w, asked] : {std::pair<double&, double>{wheels(0), left}, {wheels(1), right}}) {
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

const DriveRecording& excited() {
  static const DriveRecording recording = record(plantWith(0.1, 0.05, 1.0, 10.0));
  return recording;
}

bool covers(const Estimate& estimate, double truth) {
  return estimate.known() && std::abs(estimate.value - truth) <= estimate.half_width;
}

/// Whether there is a remark that begins so.
bool remarked(const Identification& found, const std::string& text) {
  return std::any_of(found.remarks.begin(), found.remarks.end(),
                     [&](const std::string& remark) { return remark.rfind(text, 0) == 0; });
}

// ---- estimates

TEST(PlantIdentification, FindsTheDriveTrainThroughTheNoise) {
  const Identification found = identify(record(plantWith(0.12, 0.06, 0.9, 4.0)));
  EXPECT_NEAR(found.dead_time.value, 0.12, 0.005);
  EXPECT_NEAR(found.lag.value, 0.06, 0.006);
  EXPECT_NEAR(found.gain.value, 0.9, 0.005);
  EXPECT_NEAR(found.acceleration_limit.value, 4.0, 0.3);
  EXPECT_TRUE(found.acceleration_limit.known());
  EXPECT_NEAR(found.residual, 0.03, 0.002) << "the noise of the encoders remains";
  EXPECT_LT(std::abs(found.lag.value - 0.06), 3 * found.lag.half_width + 0.002);
  const Identification unlimited = identify(record(plantWith(0.1, 0.2, 1.0, 100.0)));
  EXPECT_FALSE(unlimited.acceleration_limit.known());
  EXPECT_GT(unlimited.acceleration_limit.value, 1.0);
  EXPECT_NEAR(unlimited.lag.value, 0.2, 0.02);
}

TEST(PlantIdentification, FindsTheEffectiveTrackOfEachDirection) {
  DriveRecording slow_turn = excited();
  constexpr double kSlow = 0.12, kTrack = 0.547;  // rad/s of each wheel, m
  for (int k = 1; k <= 500; ++k) {
    const double time = excited().wheels.back().time + 0.02 * k;
    slow_turn.commands.push_back({time, {-kSlow, kSlow}});
    slow_turn.wheels.push_back({time, {-kSlow, kSlow}});
    slow_turn.yaw.push_back({time, kRadius * 2.0 * kSlow / kTrack});  // no bias of the gyro
  }
  for (const DriveRecording& recording : {excited(), slow_turn}) {
    const Identification found = identify(recording);
    ASSERT_TRUE(found.track_left.known() && found.track_right.known());
    EXPECT_NEAR(found.track_left.value, kTrack, 0.03 * kTrack);
    EXPECT_NEAR(found.track_right.value, kTrack, 0.03 * kTrack);
    EXPECT_NEAR(found.track_left.value, found.track_right.value, 0.03 * kTrack);
  }
}

/// theta_dot = r alpha (w_R - w_L) / b_hat (3-1)
TEST(PlantIdentification, TrackIsThatOfTheGivenSlipFactor) {
  const DriveRecording recording = record(Drive{});
  for (const double slip_factor : {0.8, 1.0, 1.2}) {
    const Identification found = identifyDriveTrain(recording, kRadius, slip_factor);
    for (const Estimate& track : {found.track_left, found.track_right}) {
      ASSERT_TRUE(track.known()) << track.unknown;
      EXPECT_NEAR(track.value, slip_factor * Drive{}.track, 0.005 * slip_factor * Drive{}.track);
    }
  }
}

TEST(PlantIdentification, ImuMayComeAtOtherTimesThanTheWheels) {
  for (const double late : {0.003, -0.003, 0.009}) {
    for (const double imu_rate : {20.0, 50.0, 80.0}) {
      for (const double wheel_rate : {20.0, 50.0}) {
        SCOPED_TRACE(testing::Message() << late << " " << imu_rate << " " << wheel_rate);
        Drive drive;
        drive.imu_stamp = late;
        drive.imu_rate = imu_rate;
        drive.wheel_rate = wheel_rate;
        const Identification found = identify(record(drive));
        ASSERT_TRUE(found.track_left.known()) << found.track_left.unknown;
        ASSERT_TRUE(found.track_right.known()) << found.track_right.unknown;
        EXPECT_NEAR(found.track_left.value, 0.6, 0.03);
        EXPECT_NEAR(found.track_right.value, 0.6, 0.03);
        EXPECT_NEAR(found.dead_time.value, 0.1, 0.01);
      }
    }
  }
}

TEST(PlantIdentification, ModelsTheOffsetOfTheMotors) {
  Drive drive;
  drive.offset = 0.5;
  drive.gain = 0.95;
  const Identification found = identify(record(drive));
  EXPECT_NEAR(found.gain.value, 0.95, 0.005);
  EXPECT_NEAR(found.offset.value, 0.5, 0.03);
  EXPECT_TRUE(remarked(found, "offset: "));
  EXPECT_GT(found.r_squared, 0.999);
}

TEST(PlantIdentification, IntervalsCoverSidesAndDirectionsThatDiffer) {
  const auto identified = [](double Drive::*quantity, double value) {
    Drive drive;
    drive.*quantity = value;
    return identify(record(drive));
  };
  Identification found = identified(&Drive::right_gain, 0.8);
  EXPECT_TRUE(remarked(found, "left and right differ: gain 1.00"));
  EXPECT_TRUE(covers(found.gain, 1.0) && covers(found.gain, 0.8)) << found.gain.value << " " << found.gain.half_width;
  found = identified(&Drive::right_later, 0.1);
  EXPECT_TRUE(remarked(found, "left and right differ: dead time 0.10"));
  EXPECT_TRUE(covers(found.dead_time, 0.1) && covers(found.dead_time, 0.2)) << found.dead_time.value;
  found = identified(&Drive::backward_gain, 0.8);
  EXPECT_TRUE(remarked(found, "forward and backward differ: gain 1.0") ||
              remarked(found, "forward and backward differ: gain 0.99"));
  EXPECT_TRUE(covers(found.gain, 1.0) && covers(found.gain, 0.8)) << found.gain.value << " " << found.gain.half_width;
  EXPECT_FALSE(found.offset.known());
  EXPECT_FALSE(remarked(found, "offset: "));
  for (const double offset : {0.0, 0.5}) {
    found = identified(&Drive::offset, offset);
    EXPECT_FALSE(remarked(found, "left and right differ") || remarked(found, "forward and backward differ")) << offset;
    EXPECT_TRUE(covers(found.offset, offset)) << found.offset.value;
  }
}

TEST(PlantIdentification, HeldWheelSpeedIsOneMeasurement) {
  for (const auto& [rate, hold] : {std::pair(50.0, 0.1), std::pair(20.0, 0.1), std::pair(50.0, 0.07)}) {
    SCOPED_TRACE(std::to_string(rate) + " Hz, held " + std::to_string(hold) + " s");
    Drive drive;
    drive.wheel_rate = rate;
    drive.hold = hold;
    const Identification found = identify(record(drive));
    EXPECT_TRUE(
        remarked(found, "held: the wheel speeds are renewed every 0." + std::to_string(std::lround(1e3 * hold) / 100)));
    EXPECT_TRUE(covers(found.dead_time, drive.dead_time)) << found.dead_time.value << " " << found.dead_time.half_width;
    EXPECT_TRUE(covers(found.lag, drive.lag)) << found.lag.value << " " << found.lag.half_width;
    // One in twenty misses by chance, this by the last digit.
    EXPECT_LE(std::abs(found.gain.value - drive.gain), found.gain.half_width + 0.001);
    EXPECT_EQ(found.sensor_rate, rate);
  }
  for (const double step : {0.0065, 0.1, 0.3}) {  // coarse encoders repeat, too
    for (const double noise : {0.0, 0.03}) {
      auto parameters = plantWith(0.1, 0.1, 1.0, 1.65);
      parameters.encoder_step = step;
      parameters.encoder_noise = noise;
      const Identification found = identify(record(parameters));
      EXPECT_FALSE(remarked(found, "held")) << step << " " << noise;
      EXPECT_EQ(found.sensor_rate, 50.0);
    }
  }
}

// ---- flaws of a recording

/// A bit that flips on a bus, or a counter that wraps.
TEST(PlantIdentification, SpikesChangeLittle) {
  const DriveRecording clean = record(plantWith(0.1, 0.05, 0.95, 3.0));
  const Identification expected = identify(clean);
  for (const double spike : {4000.0, -60.0, 5.0}) {
    DriveRecording spiked = clean;
    for (const std::size_t at : {150, 151, 420, 700}) spiked.wheels[at].speed.right += spike;
    for (const std::size_t at : {300, 600}) spiked.yaw[at].yaw_rate += 0.1 * spike;
    const Identification found = identify(spiked);
    EXPECT_NEAR(found.dead_time.value, expected.dead_time.value, 1e-3) << spike;
    EXPECT_NEAR(found.lag.value, expected.lag.value, 3e-3) << spike;
    EXPECT_NEAR(found.gain.value, expected.gain.value, 1e-3) << spike;
    EXPECT_NEAR(found.track_left.value, expected.track_left.value, 1e-3) << spike;
    ASSERT_EQ(found.fitted.size(), spiked.wheels.size());
    ASSERT_GE(found.remarks.size(), 2u) << spike;
    // Next to two in a row on a ramp a third value may count as one.
    EXPECT_NE(found.remarks[0].find(" of 1680 wheel speeds left out"), std::string::npos) << found.remarks[0];
    EXPECT_NE(found.remarks[1].find("spikes: 2 of 840 yaw rates"), std::string::npos) << found.remarks[1];
  }
  EXPECT_FALSE(remarked(expected, "spikes"));
}

TEST(PlantIdentification, RemarksOnWhatWasClippedCutOrMissing) {
  auto slow = plantWith(0.1, 0.05, 1.0, 10.0);
  slow.speed_limit = 0.45;
  DriveRecording one_sided = excited(), gap = record(Drive{}), unexplained = record(Drive{});
  // The first two pieces after the rest: half speed forward, rest.
  const double end = one_sided.commands.front().time + 2.7;
  const auto cut = [&](auto& series) {
    while (!series.empty() && series.back().time > end) series.pop_back();
  };
  cut(one_sided.commands), cut(one_sided.wheels), cut(one_sided.yaw);
  const auto part = [](auto& series) {
    series.erase(std::remove_if(series.begin(), series.end(),
                                [](const auto& sample) { return sample.time > 9.0 && sample.time < 10.3; }),
                 series.end());
    for (auto& sample : series) sample.time += sample.time > 9.5 ? 3600.0 : 0.0;
  };
  part(gap.commands), part(gap.wheels), part(gap.yaw);
  for (auto& sample : unexplained.wheels) {
    if (sample.time > 8.0 && sample.time < 12.0) sample.speed = {-6.0, 6.0};
  }
  const struct {
    DriveRecording recording;
    const char* remark;
    double tolerance;  // of dead time [s] and gain
  } rows[] = {{record(slow), "clipped", 0.02},
              {one_sided, "one-sided", 1.0},
              {gap, "cut: 1 gap of more than 0.5 s", 0.005},
              {unexplained, "commands do not explain", 0.005}};
  for (const auto& row : rows) {
    const Identification found = identify(row.recording);
    ASSERT_FALSE(found.remarks.empty()) << row.remark;
    EXPECT_NE(found.remarks.front().find(row.remark), std::string::npos) << found.remarks.front();
    EXPECT_NEAR(found.dead_time.value, 0.1, row.tolerance) << row.remark;
    EXPECT_NEAR(found.gain.value, 1.0, row.tolerance) << row.remark;
  }
  EXPECT_GT(identify(unexplained).r_squared, 0.99);
}

TEST(PlantIdentification, SaysWhyThereIsNoTrack) {
  auto blocks = plantWith(0.1, 0.05, 1.0, 10.0);
  blocks.support = sim::Support::box;
  const Identification on_blocks = identify(record(blocks));
  EXPECT_NEAR(on_blocks.dead_time.value, 0.1, 0.01);
  EXPECT_NE(on_blocks.track_left.unknown.find("blocks"), std::string::npos);

  const DriveRecording good = record(Drive{});
  const auto scaled = [](double scale) {
    return [scale](DriveRecording& r) {
      for (auto& sample : r.yaw) sample.yaw_rate *= scale;
    };
  };
  const std::pair<std::function<void(DriveRecording&)>, const char*> rows[] = {
      {[](DriveRecording& r) {
         for (auto& sample : r.yaw) sample.time += 100.0;
       },
       "wheel speeds and IMU data do not overlap"},
      {[](DriveRecording& r) { r.yaw.clear(), r.yaw_unknown = "the mounting of the IMU is unknown"; },
       "the mounting of the IMU is unknown"},
      {[](DriveRecording& r) {
         r.yaw = {r.yaw.front(), r.yaw.back()};
       },
       "no IMU data within"},
      {scaled(-1.0), "upside down"},
      {scaled(180.0 / M_PI), " m, must be within 0.196 to 1.96 m"},
      {scaled(0.2), " m, must be within 0.196 to 1.96 m"}};
  for (const auto& [change, unknown] : rows) {
    DriveRecording changed = good;
    change(changed);
    const Identification found = identify(changed);
    EXPECT_FALSE(found.track_left.known());
    EXPECT_NE(found.track_left.unknown.find(unknown), std::string::npos) << found.track_left.unknown;
  }
  DriveRecording degrees = good;
  scaled(180.0 / M_PI)(degrees);
  for (const Estimate& side : {identify(degrees).track_left, identify(degrees).track_right}) {
    EXPECT_NEAR(std::atof(side.unknown.c_str()), 0.01047, 1e-4) << side.unknown;
  }
}

// ---- refusals

/// Changes every command, or every sample of the wheels.
std::function<void(DriveRecording&)> commands(const std::function<void(CommandSample&)>& change) {
  return [change](DriveRecording& r) { std::for_each(r.commands.begin(), r.commands.end(), change); };
}
std::function<void(DriveRecording&)> wheels(const std::function<void(WheelSample&)>& change) {
  return [change](DriveRecording& r) { std::for_each(r.wheels.begin(), r.wheels.end(), change); };
}

TEST(PlantIdentification, RefusesUselessRecordingsInOneLine) {
  using Command = CommandSample;
  using Wheels = WheelSample;
  const DriveRecording empty, drive = record(Drive{});
  Drive late, slow;
  late.dead_time = 0.55;
  slow.wheel_rate = 20.0;
  slow.hold = 0.25;
  const DriveRecording too_late = record(late), too_slow = record(slow);
  const auto none = [](DriveRecording&) {};
  const struct {
    const DriveRecording& recording;
    std::function<void(DriveRecording&)> change;
    const char* message;
  } rows[] = {
      {empty, none, "wheel commands: 0 samples"},
      {too_late, none, "dead time: the estimate is at the end of the range"},
      {too_slow, none, "the wheel speeds are renewed every 0.250 s only"},
      {excited(), [](DriveRecording& r) { r.wheels[100].speed.left = 1e300; },
       "wheel speeds = 1e+300 rad/s at 2.020 s: must be within +-10000 rad/s"},
      {excited(), [](DriveRecording& r) { r.yaw[100].yaw_rate = -2e3; },
       "yaw rate = -2000 rad/s at 2.020 s: must be within +-1000 rad/s"},
      {excited(), [](DriveRecording& r) { r.commands[100].command.right = 3e38; },
       "wheel commands = 3e+38 rad/s at 2.007 s: must be within +-10000 rad/s"},
      {excited(), [](DriveRecording& r) { std::swap(r.wheels[50], r.wheels[51]); }, "not monotonic"},
      {excited(), [](DriveRecording& r) { r.wheels[10].speed.left = std::nan(""); },
       "wheel speeds at 0.220 s: a value is not finite"},
      {excited(), [](DriveRecording& r) { r.wheels.resize(20); }, "wheel speeds: 20 samples"},
      {excited(), commands([](Command& c) { c.command = {}; }),
       "wheel commands: no excitation (0 steps of 0.5 rad/s or more, at least 2 are needed)"},
      {excited(), commands([](Command& c) { c.command.left = 0.0; }), "no excitation of the left wheels (0 steps"},
      {excited(), wheels([](Wheels& w) { w.time += 3600.0; }),
       "wheel speeds and commands do not overlap in time (3600.020 to "},
      {drive, wheels([](Wheels& w) { w.speed = {}; }), "the wheels never turn"},
      {drive, wheels([](Wheels& w) { w.speed.right = 0.0; }), "the right wheels never turn"},
      {drive, commands([](Command& c) {
         c.command = {-c.command.left, -c.command.right};
       }),
       "the wheels turn against their commands"},
      {drive, wheels([](Wheels& w) { w.speed.left = -w.speed.left; }), "the left wheels turn against"},
      {drive, wheels([](Wheels& w) { std::swap(w.speed.left, w.speed.right); }), "left and right are exchanged"},
      {drive, wheels([](Wheels& w) { w.time -= 0.15; }), "the wheels answer before their commands"}};
  for (const auto& row : rows) {
    DriveRecording changed = row.recording;
    row.change(changed);
    const std::string what = complaint<IdentificationError>([&] { identify(changed); });
    EXPECT_NE(what.find(row.message), std::string::npos) << row.message << ": " << what;
  }
}

}  // namespace
}  // namespace jackal_aic
