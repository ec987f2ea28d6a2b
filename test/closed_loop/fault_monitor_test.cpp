// Faults of the simulated robot under the fault monitor: found in time, for what they are, and never without one.

#include <gtest/gtest.h>

#include <ostream>
#include <random>
#include <tuple>

#include "monitored_loop.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kFaultTime = 3.0;  // s
constexpr double kDetection = 0.3;  // s, the longest time to find a fault

const PackageFiles& files() {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  return files;
}

std::vector<MonitoredSample> run(const char* controller, const char* plant, const SetPointProfile& profile,
                                 const Faults& faults, const Overrides& overrides = {}) {
  return runMonitored(loadSetup(files(), controller, plant, overrides), monitorModel(files(), plant), profile, faults);
}

SetPointProfile driving(const SetPoint& set_point) {
  SetPointProfile profile;
  profile.changes = {{kRestTime, set_point}};
  profile.duration = kFaultTime + 1.0;
  return profile;
}

struct Motion {
  const char* name;
  SetPoint set_point;
};
void PrintTo(const Motion& motion, std::ostream* out) { *out << motion.name; }

const Motion kMotions[] = {{"slow", {0.5, 0.0, 0.0}},
                           {"fast", {1.0, 0.0, 0.0}},
                           {"turn", {0.0, 0.0, 0.5}},
                           {"arc", {0.5, 0.0, 0.5}},
                           {"back", {-0.5, 0.0, 0.0}}};

Faults sensor(SensorFaultKind kind, Side side = Side::left, double value = 0.0) {
  Faults faults;
  faults.sensors = {{kind, side, value, kFaultTime}};
  return faults;
}

Faults motor(Side side) {
  Faults faults;
  faults.motors = {{side, kFaultTime, 1e9}};
  return faults;
}

struct Fault {
  const char* name;
  Faults faults;
  const char* on_ground;  // reason
  const char* on_box;
};
void PrintTo(const Fault& fault, std::ostream* out) { *out << fault.name; }

const Fault kFaults[] = {
    {"LeftEncoderFrozen", sensor(SensorFaultKind::encoder_freeze), "left encoder frozen", "left encoder frozen"},
    {"RightEncoderFrozen", sensor(SensorFaultKind::encoder_freeze, Side::right), "right encoder frozen",
     "right encoder frozen"},
    {"LeftEncoderDead", sensor(SensorFaultKind::encoder_value), "left encoder wrong",
     "left wheels do not follow their command"},
    {"GyroBias", sensor(SensorFaultKind::gyro_offset, Side::left, 0.2), "gyro disagrees with the wheels",
     "gyro disagrees with the wheels"},
    {"GyroBiasDown", sensor(SensorFaultKind::gyro_offset, Side::left, -0.2), "gyro disagrees with the wheels",
     "gyro disagrees with the wheels"},
    {"GyroFrozen", sensor(SensorFaultKind::gyro_freeze), "gyro frozen", "gyro frozen"},
    {"ImuUpsideDown", sensor(SensorFaultKind::imu_flip), "IMU upside down", "IMU upside down"},
    {"LeftMotorBlocked", motor(Side::left), "left wheels do not follow their command",
     "left wheels do not follow their command"},
    {"RightMotorBlocked", motor(Side::right), "right wheels do not follow their command",
     "right wheels do not follow their command"}};

class EveryFault : public testing::TestWithParam<std::tuple<const char*, const char*, Motion, Fault>> {};

TEST_P(EveryFault, IsFoundInTimeForWhatItIs) {
  const auto [controller, plant, motion, fault] = GetParam();
  const auto found = detection(run(controller, plant, driving(motion.set_point), fault.faults), kFaultTime);
  ASSERT_TRUE(found);
  EXPECT_LE(found->delay, kDetection + 1e-9);
  EXPECT_EQ(found->reason, std::string(plant) == "box" ? fault.on_box : fault.on_ground);
}

std::string nameOf(const testing::TestParamInfo<EveryFault::ParamType>& info) {
  const auto& [controller, plant, motion, fault] = info.param;
  return std::string(controller) + "_" + plant + "_" + motion.name + "_" + fault.name;
}

INSTANTIATE_TEST_SUITE_P(Predictive, EveryFault,
                         testing::Combine(testing::Values("predictive"), testing::Values("ground", "box"),
                                          testing::ValuesIn(kMotions), testing::ValuesIn(kFaults)),
                         nameOf);
INSTANTIATE_TEST_SUITE_P(Improved, EveryFault,
                         testing::Combine(testing::Values("improved"), testing::Values("ground"),
                                          testing::ValuesIn(kMotions), testing::ValuesIn(kFaults)),
                         nameOf);

/// Share of a run's samples in a span of time in which a channel counted.
double shareCounted(const std::vector<MonitoredSample>& samples, bool ChannelValidity::*channel, double from,
                    double until) {
  int counted = 0, all = 0;
  for (const MonitoredSample& s : samples) {
    if (s.time < from - 1e-9 || s.time >= until - 1e-9) continue;
    ++all;
    counted += s.counted.*channel;
  }
  return static_cast<double>(counted) / all;
}

TEST(Outliers, AreExcludedOneByOneAndAreNoFault) {
  Faults bursts;
  for (double time : {3.0, 3.5, 4.0}) {
    bursts.sensors.push_back({SensorFaultKind::encoder_offset, Side::left, 20.0, time, time + 0.06});
    bursts.sensors.push_back({SensorFaultKind::gyro_offset, Side::left, -3.0, time + 0.2, time + 0.26});
  }
  SetPointProfile profile = driving({0.5, 0.0, 0.3});
  profile.duration = 5.0;
  const auto samples = run("predictive", "ground", profile, bursts);
  for (double time : {3.0, 3.5, 4.0}) {
    EXPECT_EQ(shareCounted(samples, &ChannelValidity::wheel_left, time, time + 0.06), 0.0);
    EXPECT_EQ(shareCounted(samples, &ChannelValidity::wheel_left, time + 0.06, time + 0.5), 1.0);
    EXPECT_EQ(shareCounted(samples, &ChannelValidity::yaw_rate, time + 0.2, time + 0.26), 0.0);
  }
  for (const MonitoredSample& s : samples) {
    EXPECT_FALSE(s.report.faulty()) << s.report.reason() << " at " << s.time;
    if (s.time < kFaultTime) continue;
    EXPECT_NEAR(s.velocity, 0.5, 0.02) << s.time;
    EXPECT_NEAR(s.yaw_rate, 0.3, 0.05) << s.time;
  }
}

struct Passing {
  const char* name;
  SensorFault fault;
  bool ChannelValidity::*channel;
};
void PrintTo(const Passing& passing, std::ostream* out) { *out << passing.name; }

class Recovery : public testing::TestWithParam<Passing> {};

TEST_P(Recovery, ChannelCountsAgainAfterTheFaultIsOver) {
  const double over = kFaultTime + 1.0;
  Faults faults;
  faults.sensors = {GetParam().fault};
  faults.sensors[0].from = kFaultTime;
  faults.sensors[0].until = over;
  SetPointProfile profile = driving({0.5, 0.0, 0.3});
  profile.duration = over + 3.0;
  const auto samples = run("predictive", "ground", profile, faults);
  EXPECT_EQ(shareCounted(samples, GetParam().channel, kFaultTime + kDetection, over + 0.9), 0.0);
  EXPECT_GE(shareCounted(samples, GetParam().channel, over + 2.0, over + 3.0), 0.98);
  for (const MonitoredSample& s : samples) {
    if (s.time < kFaultTime) continue;
    EXPECT_NEAR(s.velocity, 0.5, 0.05) << s.time;
    EXPECT_NEAR(s.yaw_rate, 0.3, 0.08) << s.time;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Sensors, Recovery,
    testing::Values(Passing{"Encoder", {SensorFaultKind::encoder_freeze, Side::left}, &ChannelValidity::wheel_left},
                    Passing{
                        "DeadEncoder", {SensorFaultKind::encoder_value, Side::right}, &ChannelValidity::wheel_right},
                    Passing{"Gyro", {SensorFaultKind::gyro_offset, Side::left, 0.2}, &ChannelValidity::yaw_rate},
                    Passing{"Imu", {SensorFaultKind::imu_flip}, &ChannelValidity::acceleration}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(FrozenEncoder, DoesNotHinderTheRobotFromFollowingANewSetPoint) {
  SetPointProfile profile = driving({0.5, 0.0, 0.0});
  profile.changes.push_back({kFaultTime + 0.5, {0.3, 0.0, 0.4}});
  profile.duration = 6.0;
  for (const char* controller : {"predictive", "improved"}) {
    const auto samples = run(controller, "ground", profile, sensor(SensorFaultKind::encoder_freeze));
    EXPECT_NEAR(samples.back().velocity, 0.3, 0.02) << controller;
    EXPECT_NEAR(samples.back().yaw_rate, 0.4, 0.05) << controller;
  }
}

TEST(BlockedMotor, StaysReportedWhileTheRobotIsStopped) {
  SetPointProfile profile = driving({0.5, 0.0, 0.0});
  profile.duration = 8.0;
  const auto samples = run("predictive", "ground", profile, motor(Side::left));
  EXPECT_TRUE(samples.back().report.drive_left);
  EXPECT_FALSE(samples.back().report.drive_right);
  EXPECT_NEAR(samples.back().velocity, 0.0, 0.01);
}

TEST(BlockedMotor, IsFoundWhenTheRobotShouldStart) {
  for (const SetPoint& set_point : {SetPoint{0.5, 0.0, 0.0}, SetPoint{0.0, 0.0, 1.0}, SetPoint{0.1, 0.0, 0.0}}) {
    SetPointProfile profile;
    profile.changes = {{kFaultTime, set_point}};
    profile.duration = 5.0;
    Faults faults;
    faults.motors = {{Side::right, 0.0, 1e9}};
    const auto found = detection(run("predictive", "ground", profile, faults), kFaultTime);
    ASSERT_TRUE(found);
    EXPECT_LE(found->delay, 0.7) << "dead time, acceleration and uncertain timing included";
    EXPECT_EQ(found->reason, "right wheels do not follow their command");
  }
}

/// Ordinary driving: steps, turns in place, arcs and square waves in random order.
SetPointProfile ordinaryDriving(std::uint64_t seed, double duration) {
  const double speeds[] = {0.0, 0.1, 0.3, 0.5, 1.0, -0.5};
  const double turns[] = {0.0, 0.2, 0.5, 1.0, -0.5, -1.0};
  std::mt19937_64 random(seed);
  const auto pick = [&](const double(&values)[6]) { return values[random() % 6]; };
  SetPointProfile profile;
  double time = kRestTime;
  const auto add = [&](const SetPoint& set_point, double seconds) {
    profile.changes.push_back({time, set_point});
    time += seconds;
  };
  while (time < duration) {
    const double length = 1.0 + 0.001 * static_cast<double>(random() % 3000);
    switch (random() % 4) {
      case 0:
        add({pick(speeds), 0.0, 0.0}, length);
        break;
      case 1:
        add({0.0, 0.0, pick(turns)}, length);
        break;
      case 2:
        add({pick(speeds), 0.0, pick(turns)}, length);
        break;
      default:
        for (int i = 0; i < 3; ++i) {
          add({0.1, 0.0, 0.0}, 2.0);
          add({0.5, 0.0, 0.0}, 2.0);
        }
    }
  }
  profile.duration = duration;
  return profile;
}

struct Condition {
  const char* name;
  const char* plant;
  double duration;  // s
  Overrides overrides;
};
void PrintTo(const Condition& condition, std::ostream* out) { *out << condition.name; }

class OrdinaryDriving : public testing::TestWithParam<std::tuple<const char*, Condition>> {};

TEST_P(OrdinaryDriving, RaisesNoAlarm) {
  const auto& [controller, condition] = GetParam();
  const auto samples =
      run(controller, condition.plant, ordinaryDriving(7, condition.duration), {}, condition.overrides);
  int outliers = 0;
  for (const MonitoredSample& s : samples) {
    ASSERT_FALSE(s.report.faulty()) << s.report.reason() << " at " << s.time << " s";
    outliers += !s.counted.all();
  }
  EXPECT_LE(outliers, 0.002 * static_cast<double>(samples.size())) << "far below alpha";
}

const Condition kConditions[] = {{"Ground", "ground", 600.0, {}},
                                 {"Box", "box", 600.0, {}},
                                 {"Noisy", "ground", 120.0, {{"plant.noise_scale", "5"}}},
                                 {"NoisyBox", "box", 120.0, {{"plant.noise_scale", "5"}}},
                                 {"Slippery", "ground", 120.0, {{"plant.friction", "0.25"}}},
                                 {"Grippy", "ground", 120.0, {{"plant.friction", "1.0"}}},
                                 {"Uphill", "ground", 120.0, {{"plant.slope", "5"}}},
                                 {"Downhill", "ground", 120.0, {{"plant.slope", "-10"}}},
                                 {"Loaded", "ground", 120.0, {{"plant.payload", "8"}}},
                                 {"NoNoise", "ground", 120.0, {{"plant.noise_scale", "0"}}},
                                 {"SamplesLost", "ground", 120.0, {{"plant.measurement_loss", "0.1"}}}};

INSTANTIATE_TEST_SUITE_P(Predictive, OrdinaryDriving,
                         testing::Combine(testing::Values("predictive"), testing::ValuesIn(kConditions)),
                         [](const auto& info) { return std::string(std::get<1>(info.param).name); });
INSTANTIATE_TEST_SUITE_P(Improved, OrdinaryDriving,
                         testing::Combine(testing::Values("improved"),
                                          testing::Values(Condition{"Ground", "ground", 120.0, {}},
                                                          Condition{"Box", "box", 120.0, {}})),
                         [](const auto& info) { return std::string(std::get<1>(info.param).name); });

}  // namespace
}  // namespace jackal_aic::sim
