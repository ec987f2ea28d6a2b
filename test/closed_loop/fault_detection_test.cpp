// Faults of the simulated robot under the fault monitor: found in time, with their name, and never without a fault.

#include <gtest/gtest.h>

#include <ostream>

#include "drives.hpp"

namespace jackal_aic::sim {

namespace {

constexpr double kDelay = 0.3;  // s, the bar of sim/lab/acceptance.yaml

std::vector<MonitoredSample> run(const std::string& controller, const char* plant, const SetPointProfile& profile,
                                 const Faults& faults, const Overrides& overrides = {}) {
  return runMonitored(loadSetup(files(), controller, plant, overrides), monitorModel(files(), plant), profile, faults);
}

/// @param changes of the set point. @param duration [s].
SetPointProfile profileOf(std::vector<SetPointProfile::Change> changes, double duration) {
  SetPointProfile profile;
  profile.changes = std::move(changes);
  profile.duration = duration;
  return profile;
}

SetPointProfile driving(const SetPoint& set_point, double duration = kFaultTime + 1.0) {
  return profileOf({{kRestTime, set_point}}, duration);
}

Faults blocked(FaultChannel side, double from) { return {{FaultKind::blocked, side, 0.0, from}}; }

const Faults kFrozenLeft = sensorFault(FaultKind::freeze, FaultChannel::left);

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

TEST(Outliers, AreExcludedAndAreNoFault) {
  Faults bursts;
  for (double time : {3.0, 3.5, 4.0}) {
    bursts.push_back({FaultKind::bias, FaultChannel::left, 20.0, time, 0.06});
    bursts.push_back({FaultKind::bias, FaultChannel::gyro, -3.0, time + 0.2, 0.06});
  }
  const auto samples = run("predictive", "ground", driving({0.5, 0.0, 0.3}, 5.0), bursts);
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

struct PassingFault {
  const char* name;
  FaultKind kind;
  FaultChannel injected;
  double amount;
  bool ChannelValidity::*channel;
};
void PrintTo(const PassingFault& fault, std::ostream* out) { *out << fault.name; }

class Recovery : public testing::TestWithParam<PassingFault> {};

TEST_P(Recovery, ChannelCountsAgainAfterTheFault) {
  const PassingFault& fault = GetParam();
  const double over = kFaultTime + 1.0;
  const Faults faults{{fault.kind, fault.injected, fault.amount, kFaultTime, 1.0}};
  const auto samples = run("predictive", "ground", driving({0.5, 0.0, 0.3}, over + 3.0), faults);
  EXPECT_EQ(shareCounted(samples, fault.channel, kFaultTime + kDelay, over + 0.9), 0.0);
  EXPECT_GE(shareCounted(samples, fault.channel, over + 2.0, over + 3.0), 0.98);
  for (const MonitoredSample& s : samples) {
    if (s.time < kFaultTime) continue;
    EXPECT_NEAR(s.velocity, 0.5, 0.05) << s.time;
    EXPECT_NEAR(s.yaw_rate, 0.3, 0.08) << s.time;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Sensors, Recovery,
    testing::Values(
        PassingFault{"Encoder", FaultKind::freeze, FaultChannel::left, 0.0, &ChannelValidity::wheel_left},
        PassingFault{"DeadEncoder", FaultKind::set, FaultChannel::right, 0.0, &ChannelValidity::wheel_right},
        PassingFault{"Gyro", FaultKind::bias, FaultChannel::gyro, 0.2, &ChannelValidity::yaw_rate},
        PassingFault{"Imu", FaultKind::upside_down, FaultChannel::all, 0.0, &ChannelValidity::acceleration}),
    [](const auto& info) { return std::string(info.param.name); });

// ---- blocked motors

TEST(BlockedMotor, StaysReportedWhileTheRobotIsStopped) {
  const auto samples =
      run("predictive", "ground", driving({0.5, 0.0, 0.0}, 8.0), blocked(FaultChannel::left, kFaultTime));
  EXPECT_TRUE(samples.back().report.drive_left);
  EXPECT_FALSE(samples.back().report.drive_right);
  EXPECT_NEAR(samples.back().velocity, 0.0, 0.01);
}

/// Also by small commands, before the noise is known, and in turns, where the encoder could be blamed.
TEST(BlockedMotor, IsFoundWhenTheRobotIsToStart) {
  const struct {
    std::vector<const char*> controllers;
    std::vector<SetPoint> set_points;
    int seeds;
    double delay;  // dead time, acceleration and uncertain timing included [s]
  } rows[] = {{{"predictive"}, {{0.5, 0.0, 0.0}, {0.0, 0.0, 1.0}, {0.1, 0.0, 0.0}}, 1, 0.7},
              {{"diff_drive"}, {{0.0, 0.0, 0.5}}, 8, 1.1},
              {{"diff_drive", "improved", "predictive"}, {{0.0, 0.0, 0.5}, {0.0, 0.0, 1.0}, {0.0, 0.0, 2.0}}, 2, 1.0}};
  for (const auto& row : rows) {
    for (const char* controller : row.controllers) {
      for (const SetPoint& set_point : row.set_points) {
        for (int seed = 1; seed <= row.seeds; ++seed) {
          SCOPED_TRACE(testing::Message() << controller << ", " << set_point.forward << " m/s, " << set_point.yaw_rate
                                          << " rad/s, seed " << seed);
          const auto found = detection(run(controller, "ground", profileOf({{kFaultTime, set_point}}, kFaultTime + 2.0),
                                           blocked(FaultChannel::right, 0.0), {{"plant.seed", std::to_string(seed)}}),
                                       kFaultTime);
          ASSERT_TRUE(found);
          EXPECT_LE(found->delay, row.delay);
          EXPECT_EQ(found->reason, "right wheels do not follow their command");
        }
      }
    }
  }
}

// ---- healthy robots

struct Handling {
  const char* name;
  SetPoint set_point;
  Faults faults;  // pushes and lifts
};

std::vector<Handling> handlings() {
  std::vector<Handling> list;
  struct Push {
    double force, torque, from, until;
  };
  const auto add = [&](const char* name, const SetPoint& set_point, const std::vector<Push>& pushes) {
    list.push_back({name, set_point, {}});
    for (const Push& p : pushes) {
      list.back().faults.push_back({FaultKind::push, FaultChannel::forward, p.force, p.from, p.until - p.from});
      list.back().faults.push_back({FaultKind::push, FaultChannel::yaw_rate, p.torque, p.from, p.until - p.from});
    }
    if (pushes.empty()) list.back().faults = {{FaultKind::lift, FaultChannel::all, 0.0, 3.0, 2.0}};
  };
  for (double torque : {0.0, 15.0, -15.0}) {
    add("pushed while it stands", {}, {{150.0, torque, 3.0, 3.7}});
    add("pushed and pulled while it stands", {}, {{-120.0, torque, 3.0, 3.5}, {120.0, -torque, 3.6, 4.2}});
    add("pushed a little while it drives", {0.5, 0.0, 0.0}, {{40.0, 0.2 * torque, 3.0, 3.5}});
    add("against a kerb", {0.5, 0.0, 0.0}, {{-100.0, torque, 3.0, 3.12}});
    add("against a kerb at speed", {1.0, 0.0, 0.0}, {{-200.0, torque, 3.0, 3.12}});
    add("against a kerb in an arc", {0.5, 0.0, 0.5}, {{-100.0, torque, 3.0, 3.12}});
  }
  add("carried", {}, {});
  add("lifted while it drives", {0.3, 0.0, 0.0}, {});
  add("lifted while it turns", {0.0, 0.0, 0.5}, {});
  return list;
}

TEST(HealthyRobot, PushesKerbsAndLiftsLeaveNoFault) {
  for (const char* controller : {"predictive", "improved"}) {
    for (const char* torque_limit : {"20", "3", "2", "0.5"}) {
      for (const Handling& handling : handlings()) {
        const bool stands = handling.set_point.vector().isZero(0.0);
        if (!stands && std::string(torque_limit) == "0.5") continue;  // too weak to turn at all
        SCOPED_TRACE(std::string(controller) + ", " + torque_limit + " N m, " + handling.name);
        const auto samples = run(controller, "ground", driving(handling.set_point, 9.0), handling.faults,
                                 {{"plant.torque_limit", torque_limit}});
        const bool pushed = stands && handling.faults[0].kind == FaultKind::push;
        bool moved = false;
        for (const MonitoredSample& s : samples) {
          const FaultReport& r = s.report;
          moved = moved || r.moved;
          if (pushed) {
            EXPECT_NE(r.gyro.state, ChannelState::faulty) << "it sees the push, at " << s.time;
          }
          const bool latched = r.drive_left || r.drive_right || r.wheel_left.state == ChannelState::faulty ||
                               r.wheel_right.state == ChannelState::faulty;
          EXPECT_FALSE(latched) << r.reason() << " at " << s.time;  // the robot would not drive on
          if (latched) break;
        }
        EXPECT_STREQ(samples.back().report.reason(), "");
        EXPECT_TRUE(samples.back().counted.all());
        if (pushed && handling.faults[1].value != 0.0) {
          EXPECT_TRUE(moved);
        }
      }
    }
  }
}

// ---- frozen encoders

TEST(FrozenEncoder, RobotFollowsANewSetPoint) {
  const SetPointProfile profile = profileOf({{kRestTime, {0.5, 0.0, 0.0}}, {kFaultTime + 0.5, {0.3, 0.0, 0.4}}}, 6.0);
  for (const char* controller : {"predictive", "improved"}) {
    const auto samples = run(controller, "ground", profile, kFrozenLeft);
    EXPECT_NEAR(samples.back().velocity, 0.3, 0.02) << controller;
    EXPECT_NEAR(samples.back().yaw_rate, 0.4, 0.05) << controller;
  }
}

/// Also soon after the start, when the drive train may still be anywhere between its slowest and its fastest.
TEST(FrozenEncoder, IsFoundInTimeSoonAfterTheStart) {
  for (const std::string& controller : controllerNames()) {
    for (const char* plant : {"ground", "box"}) {
      for (const SetPoint& set_point : {SetPoint{1.0, 0.0, 0.0}, SetPoint{0.5, 0.0, 0.5}}) {
        for (double onset : {0.8, 1.2, 1.5, 2.0}) {
          for (const char* seed : {"1", "2"}) {
            SCOPED_TRACE(testing::Message() << controller << " on " << plant << ", " << set_point.forward
                                            << " m/s, frozen at " << onset << " s, seed " << seed);
            Faults faults = kFrozenLeft;
            faults[0].start = onset;
            const auto found = detection(
                run(controller, plant, profileOf({{0.38, set_point}}, onset + 1.0), faults, {{"plant.seed", seed}}),
                onset);
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

constexpr double kStepTime = 4.0;  // s, the set point changes, a second after the encoder froze

/// Of each resolution and noise: found soon after the wheel should have moved by more than three steps.
TEST(FrozenEncoder, IsFoundAtEveryResolutionOnceItsWheelShouldMove) {
  for (const char* step : {"0", "0.0065", "0.0131", "0.06", "0.0606", "0.1"}) {
    for (const char* noise : {"0", "0.003", "0.03"}) {
      for (double change : {0.1, -0.2, 0.5}) {
        for (const char* controller : {"predictive", "improved", "diff_drive"}) {
          SCOPED_TRACE(testing::Message() << controller << ", step " << step << ", noise " << noise << ", " << change);
          const auto samples =
              run(controller, "ground",
                  profileOf({{kRestTime, {0.5, 0.0, 0.0}}, {kStepTime, {0.5 + change, 0.0, 0.0}}}, 6.0), kFrozenLeft,
                  {{"plant.encoder_step", step}, {"plant.encoder_noise", noise}});
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

/// A robot that settled long ago and slows down: the wide prediction of its start is over.
TEST(FrozenEncoder, IsFoundAfterALongSteadyDrive) {
  for (const char* plant : {"ground", "real"}) {
    for (const char* controller : {"predictive", "improved", "diff_drive"}) {
      for (const char* step : {"0.0065", "0.06", "0.0606", "0.1"}) {
        for (double speed : {0.5, 1.0, 1.1, 1.5}) {
          SCOPED_TRACE(testing::Message() << controller << " on " << plant << ", step " << step << ", " << speed);
          const SetPointProfile profile =
              profileOf({{kRestTime, {speed, 0.0, 0.0}}, {kStepTime, {0.7 * speed, 0.0, 0.0}}}, 6.0);
          const auto found = detection(run(controller, plant, profile, kFrozenLeft,
                                           {{"plant.encoder_step", step}, {"plant.encoder_noise", "0"}}),
                                       kFaultTime);  // or before the step, where the frozen value misleads the wheels
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
