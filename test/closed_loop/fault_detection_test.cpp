// Faults of the simulated robot under the fault monitor: found in time, for what they are, and never without one.

#include <gtest/gtest.h>

#include <ostream>

#include "drives.hpp"

namespace jackal_aic::sim {

namespace {

constexpr double kDelay = 0.3;  // s, the bar of sim/lab/acceptance.yaml

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

/// Share of a run's samples in a span of time in which a channel counted.
double shareCounted(const std::vector<MonitoredSample>& samples, bool ChannelValidity::*channel, double from,
                    double until) {
  int counted = 0, all = 0;
  for (const MonitoredSample& s : samples) {
    if (s.time < from - 1e-9 || s.time >= until - 1e-9) continue;
    ++all;
    counted += s.counted.*channel;
  }
  EXPECT_GT(all, 0) << "no sample from " << from << " to " << until << " s";
  return static_cast<double>(counted) / all;
}

TEST(Outliers, AreExcludedOneByOneAndAreNoFault) {
  Faults bursts;
  for (double time : {3.0, 3.5, 4.0}) {
    bursts.sensors.push_back({FaultKind::bias, FaultChannel::left, 20.0, time, 0.06});
    bursts.sensors.push_back({FaultKind::bias, FaultChannel::gyro, -3.0, time + 0.2, 0.06});
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
  faults.sensors[0].start = kFaultTime;
  faults.sensors[0].duration = 1.0;
  SetPointProfile profile = driving({0.5, 0.0, 0.3});
  profile.duration = over + 3.0;
  const auto samples = run("predictive", "ground", profile, faults);
  EXPECT_EQ(shareCounted(samples, GetParam().channel, kFaultTime + kDelay, over + 0.9), 0.0);
  EXPECT_GE(shareCounted(samples, GetParam().channel, over + 2.0, over + 3.0), 0.98);
  for (const MonitoredSample& s : samples) {
    if (s.time < kFaultTime) continue;
    EXPECT_NEAR(s.velocity, 0.5, 0.05) << s.time;
    EXPECT_NEAR(s.yaw_rate, 0.3, 0.08) << s.time;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Sensors, Recovery,
    testing::Values(Passing{"Encoder", {FaultKind::freeze, FaultChannel::left}, &ChannelValidity::wheel_left},
                    Passing{"DeadEncoder", {FaultKind::set, FaultChannel::right}, &ChannelValidity::wheel_right},
                    Passing{"Gyro", {FaultKind::bias, FaultChannel::gyro, 0.2}, &ChannelValidity::yaw_rate},
                    Passing{"Imu", {FaultKind::upside_down, FaultChannel::all}, &ChannelValidity::acceleration}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(FrozenEncoder, DoesNotHinderTheRobotFromFollowingANewSetPoint) {
  SetPointProfile profile = driving({0.5, 0.0, 0.0});
  profile.changes.push_back({kFaultTime + 0.5, {0.3, 0.0, 0.4}});
  profile.duration = 6.0;
  for (const char* controller : {"predictive", "improved"}) {
    const auto samples = run(controller, "ground", profile, sensorFault(FaultKind::freeze, FaultChannel::left));
    EXPECT_NEAR(samples.back().velocity, 0.3, 0.02) << controller;
    EXPECT_NEAR(samples.back().yaw_rate, 0.4, 0.05) << controller;
  }
}

TEST(BlockedMotor, StaysReportedWhileTheRobotIsStopped) {
  SetPointProfile profile = driving({0.5, 0.0, 0.0});
  profile.duration = 8.0;
  Faults blocked;
  blocked.motors = {{Side::left, kFaultTime, 1e9}};
  const auto samples = run("predictive", "ground", profile, blocked);
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

TEST(BlockedMotor, IsFoundBySmallCommandsBeforeTheNoiseIsKnown) {
  for (const char* seed : {"1", "2", "3", "4", "5", "6", "7", "8"}) {
    SetPointProfile profile;
    profile.changes = {{kFaultTime, {0.0, 0.0, 0.5}}};
    profile.duration = kFaultTime + 2.0;
    Faults faults;
    faults.motors = {{Side::right, 0.0, 1e9}};
    const auto found = detection(run("diff_drive", "ground", profile, faults, {{"plant.seed", seed}}), kFaultTime);
    ASSERT_TRUE(found) << "seed " << seed;
    EXPECT_LE(found->delay, 1.1) << "seed " << seed;
    EXPECT_EQ(found->reason, "right wheels do not follow their command") << "seed " << seed;
  }
}

TEST(BlockedMotor, IsNotTakenForItsEncoderHoweverTheRobotTurns) {
  for (const char* controller : {"diff_drive", "improved", "predictive"}) {
    for (const double yaw_rate : {0.5, 1.0, 2.0}) {
      for (const char* seed : {"1", "2"}) {
        SetPointProfile profile;
        profile.changes = {{kFaultTime, {0.0, 0.0, yaw_rate}}};
        profile.duration = kFaultTime + 1.0;
        Faults faults;
        faults.motors = {{Side::right, 0.0, 1e9}};
        const auto found = detection(run(controller, "ground", profile, faults, {{"plant.seed", seed}}), kFaultTime);
        ASSERT_TRUE(found) << controller << ", " << yaw_rate;
        EXPECT_EQ(found->reason, "right wheels do not follow their command") << controller << ", " << yaw_rate;
      }
    }
  }
}

/// What somebody does to a healthy robot, and what it does meanwhile.
struct Handling {
  const char* name;
  SetPoint set_point;
  Faults faults;
};

std::vector<Handling> handlings() {
  std::vector<Handling> list;
  const auto add = [&](const char* name, const SetPoint& set_point, std::vector<Push> pushes, std::vector<Lift> lifts) {
    Handling handling{name, set_point, {}};
    handling.faults.pushes = std::move(pushes);
    handling.faults.lifts = std::move(lifts);
    list.push_back(handling);
  };
  for (double torque : {0.0, 15.0, -15.0}) {
    add("pushed while it stands", {}, {{150.0, torque, 3.0, 3.7}}, {});
    add("pushed and pulled while it stands", {}, {{-120.0, torque, 3.0, 3.5}, {120.0, -torque, 3.6, 4.2}}, {});
    add("pushed a little while it drives", {0.5, 0.0, 0.0}, {{40.0, 0.2 * torque, 3.0, 3.5}}, {});
    add("against a kerb", {0.5, 0.0, 0.0}, {{-100.0, torque, 3.0, 3.12}}, {});
    add("against a kerb at speed", {1.0, 0.0, 0.0}, {{-200.0, torque, 3.0, 3.12}}, {});
    add("against a kerb in an arc", {0.5, 0.0, 0.5}, {{-100.0, torque, 3.0, 3.12}}, {});
  }
  add("carried", {}, {}, {{3.0, 5.0}});
  add("lifted while it drives", {0.3, 0.0, 0.0}, {}, {{3.0, 5.0}});
  add("lifted while it turns", {0.0, 0.0, 0.5}, {}, {{3.0, 5.0}});
  return list;
}

TEST(HealthyRobot, PushesKerbsAndLiftsLeaveNothing) {
  for (const char* controller : {"predictive", "improved"}) {
    for (const char* torque_limit : {"20", "3", "2", "0.5"}) {
      for (const Handling& handling : handlings()) {
        const bool stands = handling.set_point.vector().isZero(0.0);
        if (!stands && std::string(torque_limit) == "0.5") continue;  // too weak to turn at all
        SCOPED_TRACE(std::string(controller) + ", " + torque_limit + " N m, " + handling.name);
        SetPointProfile profile = driving(handling.set_point);
        profile.duration = 9.0;
        const auto samples =
            run(controller, "ground", profile, handling.faults, {{"plant.torque_limit", torque_limit}});
        const bool pushed = stands && !handling.faults.pushes.empty();
        bool moved = false;
        for (const MonitoredSample& s : samples) {
          const FaultReport& r = s.report;
          moved = moved || r.moved;
          if (pushed) {
            EXPECT_NE(r.gyro.state, ChannelState::faulty) << "which sees what happens, at " << s.time;
          }
          const bool latched = r.drive_left || r.drive_right || r.wheel_left.state == ChannelState::faulty ||
                               r.wheel_right.state == ChannelState::faulty;
          EXPECT_FALSE(latched) << r.reason() << " at " << s.time;  // the robot would not drive on
          if (latched) break;
        }
        EXPECT_STREQ(samples.back().report.reason(), "");
        EXPECT_TRUE(samples.back().counted.all());
        if (pushed && handling.faults.pushes[0].torque != 0.0) {
          EXPECT_TRUE(moved) << "told as what it is";
        }
      }
    }
  }
}

/// Soon after the start, too, when the drive train may still be anywhere between its slowest and its fastest.
TEST(FrozenEncoder, IsFoundInTimeSoonAfterTheStart) {
  for (const std::string& controller : controllerNames()) {
    for (const char* plant : {"ground", "box"}) {
      for (const SetPoint& set_point : {SetPoint{1.0, 0.0, 0.0}, SetPoint{0.5, 0.0, 0.5}}) {
        for (double onset : {0.8, 1.2, 1.5, 2.0}) {
          for (const char* seed : {"1", "2"}) {
            SCOPED_TRACE(controller + " on " + plant + ", " + std::to_string(set_point.forward) + " m/s, frozen at " +
                         std::to_string(onset) + " s, seed " + seed);
            SetPointProfile profile;
            profile.changes.assign(1, {0.38, set_point});
            profile.duration = onset + 1.0;
            Faults faults = sensorFault(FaultKind::freeze, FaultChannel::left);
            faults.sensors[0].start = onset;
            const auto found =
                detection(run(controller.c_str(), plant, profile, faults, {{"plant.seed", seed}}), onset);
            EXPECT_TRUE(found) << "within a second";
            if (!found) continue;
            EXPECT_LE(found->delay, kDelay + 1e-9);
            EXPECT_EQ(found->reason, "left encoder frozen");
          }
        }
      }
    }
  }
}

/// The frozen encoder of each resolution and noise: found soon after the wheel should have moved.
TEST(FrozenEncoder, IsFoundAtEveryResolutionOnceItsWheelShouldMove) {
  constexpr double kStepTime = 4.0;  // the set point changes, a second after the encoder froze
  for (const char* step : {"0", "0.0065", "0.0131", "0.06", "0.0606", "0.1"}) {
    for (const char* noise : {"0", "0.003", "0.03"}) {
      for (double change : {0.1, -0.2, 0.5}) {
        for (const char* controller : {"predictive", "improved", "diff_drive"}) {
          SCOPED_TRACE(std::string(controller) + ", step " + step + ", noise " + noise + ", by " +
                       std::to_string(change));
          SetPointProfile profile = driving({0.5, 0.0, 0.0});
          profile.changes.push_back({kStepTime, {0.5 + change, 0.0, 0.0}});
          profile.duration = 6.0;
          const auto samples = run(controller, "ground", profile, sensorFault(FaultKind::freeze, FaultChannel::left),
                                   {{"plant.encoder_step", step}, {"plant.encoder_noise", noise}});
          // From the freeze on, or from the moment in which the wheel has moved by more than three steps.
          double moved = 0.0, found = 0.0, frozen_at = 0.0;
          for (const MonitoredSample& s : samples) {
            if (s.time < kFaultTime) frozen_at = s.wheel_left;
            if (moved == 0.0 && s.time >= kFaultTime &&
                std::abs(s.wheel_left - frozen_at) > 3.0 * std::stod(step) + 1e-3) {
              moved = s.time;
            }
            if (s.report.faulty() && found == 0.0) found = s.time;
          }
          ASSERT_GT(moved, 0.0);
          ASSERT_GT(found, kFaultTime);
          EXPECT_LE(found, std::max(moved, kStepTime) + 0.5) << "should have moved at " << moved;
        }
      }
    }
  }
}

/// A robot that settled long ago and slows down: what the wheel may have done as it started is no excuse for its
/// encoder.
TEST(FrozenEncoder, IsFoundHoweverWideThePredictionWasWhenItChangedLast) {
  constexpr double kStepTime = 4.0;  // the set point falls, a second after the encoder froze
  for (const char* plant : {"ground", "real"}) {
    for (const char* controller : {"predictive", "improved", "diff_drive"}) {
      for (const char* step : {"0.0065", "0.06", "0.0606", "0.1"}) {
        for (double speed : {0.5, 1.0, 1.1, 1.5}) {
          SCOPED_TRACE(std::string(controller) + " on " + plant + ", step " + step + ", " + std::to_string(speed) +
                       " m/s");
          SetPointProfile profile = driving({speed, 0.0, 0.0});
          profile.changes.push_back({kStepTime, {0.7 * speed, 0.0, 0.0}});
          profile.duration = 6.0;
          const auto found =
              detection(run(controller, plant, profile, sensorFault(FaultKind::freeze, FaultChannel::left),
                            {{"plant.encoder_step", step}, {"plant.encoder_noise", "0"}}),
                        kFaultTime);  // or before the step, where the frozen value leads the wheels away
          ASSERT_TRUE(found);
          EXPECT_LE(found->delay, kStepTime - kFaultTime + 0.5);
          EXPECT_EQ(found->reason, "left encoder frozen");
        }
      }
    }
  }
}

}  // namespace
}  // namespace jackal_aic::sim
