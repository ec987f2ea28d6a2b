// A sensor that is wrong from its first message: what it may cost, and that it is told.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "drives.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kFactor = 1.5;  // of the set point, that a wrong sensor may bring about
constexpr double kBeside = 0.1;  // and beside it [m/s, rad/s]
constexpr double kLongest =
    1.05;                       // for which it may be more [s]: an encoder is convicted after 0.3 to 0.6 s and a brake
constexpr double kTold = 2.0;   // after the start of the motion [s]
constexpr double kStart = 1.0;  // s

struct Channel {
  const char* name;
  std::vector<FaultChannel> channels;
};
const Channel kChannels[] = {{"left encoder", {FaultChannel::left}},
                             {"right encoder", {FaultChannel::right}},
                             {"both encoders", {FaultChannel::left, FaultChannel::right}},
                             {"gyro", {FaultChannel::gyro}},
                             {"accelerometer", {FaultChannel::acceleration}}};
const double kScales[] = {0.0, 1.0 / 3.0, 0.5, 0.7, 1.5, 2.0, 57.3, -1.0};
const SetPoint kSetPoints[] = {{0.1, 0, 0}, {0.5, 0, 0}, {0, 0, 0.2}, {0, 0, 0.8}, {0.5, 0, 0.5}};

struct Outcome {
  double beyond = 0.0;  // longest time beyond the bound [s]
  Fault told = Fault::none;
};

Outcome drive(const std::string& controller, const Channel& wrong, double scale, const SetPoint& set_point) {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  LoopSetup setup = loadSetup(files, controller, "ground", {});
  setup.drive.plant_model = assumedModel(files);
  setup.drive.on_loss = LossPolicyParameters{};
  Faults faults;
  for (const FaultChannel channel : wrong.channels) {
    faults.sensors.push_back({FaultKind::scale, channel, scale, 0.0, 1e9});
  }
  SetPointProfile profile;
  profile.changes = {{kStart, set_point}};
  profile.duration = 5.0;
  Outcome outcome;
  double since = 0.0, before = 0.0;
  runMonitored(setup, *setup.drive.plant_model, profile, faults, [&](const MonitoredSample& s) {
    const bool beyond = std::abs(s.velocity) > kFactor * std::abs(s.set_point.forward) + kBeside ||
                        std::abs(s.yaw_rate) > kFactor * std::abs(s.set_point.yaw_rate) + kBeside;
    since = beyond ? since + s.time - before : 0.0;
    before = s.time;
    outcome.beyond = std::max(outcome.beyond, since);
    if (s.time < kStart + kTold && outcome.told == Fault::none) outcome.told = s.fault;
  });
  return outcome;
}

class WrongFromTheStart : public testing::TestWithParam<const char*> {};

TEST_P(WrongFromTheStart, ASensorCostsNoMoreThanHalfOfTheSetPointAgain) {
  for (const Channel& wrong : kChannels) {
    for (const double scale : kScales) {
      for (const SetPoint& set_point : kSetPoints) {
        const Outcome outcome = drive(GetParam(), wrong, scale, set_point);
        EXPECT_LE(outcome.beyond, kLongest)
            << wrong.name << " x " << scale << ", " << set_point.forward << " m/s, " << set_point.yaw_rate << " rad/s";
      }
    }
  }
}

TEST_P(WrongFromTheStart, ItsCauseIsToldWithinTwoSecondsOfMotionWhereItCanBeKnown) {
  const auto told = [](const Channel& wrong, double scale, const SetPoint& set_point) {
    return text(drive(GetParam(), wrong, scale, set_point).told);
  };
  const SetPoint straight{0.5, 0, 0}, turn{0, 0, 0.8};
  for (const double scale : {0.0, 1.0 / 3.0, 0.5, 2.0, 57.3, -1.0}) {
    EXPECT_STRNE(told(kChannels[0], scale, straight), "") << "left encoder x " << scale;
    EXPECT_STRNE(told(kChannels[1], scale, straight), "") << "right encoder x " << scale;
    EXPECT_STRNE(told(kChannels[3], scale, turn), "") << "gyro x " << scale;
    // An accelerometer of 562 m/s^2 at rest is no reading at all (MeasurementWatch): it never counts.
    if (scale < 50.0) EXPECT_STRNE(told(kChannels[4], scale, straight), "") << "accelerometer x " << scale;
  }
  for (const double scale : {0.0, 1.0 / 3.0, 2.0, -1.0}) {
    EXPECT_STRNE(told(kChannels[2], scale, straight), "") << "both encoders x " << scale;
  }
}

INSTANTIATE_TEST_SUITE_P(Presets, WrongFromTheStart, testing::Values("predictive", "improved"),
                         [](const auto& info) { return std::string(info.param); });

TEST(HonestSensors, AreToldOfNothing) {
  static const PackageFiles files{JACKAL_AIC_SOURCE_DIR};
  for (const char* controller : {"predictive", "improved"}) {
    for (const SetPoint& set_point : kSetPoints) {
      const LoopSetup setup = loadSetup(files, controller, "ground", {});
      SetPointProfile profile;
      profile.changes = {{kStart, set_point}};
      profile.duration = 6.0;
      runMonitored(setup, monitorModel(files, "ground"), profile, {}, [&](const MonitoredSample& s) {
        EXPECT_STREQ(text(s.fault), "") << controller << ", " << set_point.forward << " m/s at " << s.time;
      });
    }
  }
}

}  // namespace
}  // namespace jackal_aic::sim
