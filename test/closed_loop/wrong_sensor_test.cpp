// A sensor that is wrong from its first message: bounds of its effect, and its report.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "drives.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kFactor = 1.5;  // of the set point, that a wrong sensor may bring about
constexpr double kSlack = 0.1;   // and in addition [m/s, rad/s]
constexpr double kLongest =
    1.05;  // for which it may be more [s]: an encoder is excluded after 0.3 to 0.6 s, and a brake
constexpr double kReported = 2.0;  // after the start of the motion [s]
constexpr double kStart = 1.0;     // s

const struct Channel {
  const char* name;
  std::vector<FaultChannel> channels;
} kLeft{"left encoder", {FaultChannel::left}}, kRight{"right encoder", {FaultChannel::right}},
    kBoth{"both encoders", {FaultChannel::left, FaultChannel::right}}, kGyro{"gyro", {FaultChannel::gyro}},
    kAccelerometer{"accelerometer", {FaultChannel::acceleration}};
const SetPoint kStraight{0.5, 0, 0}, kTurn{0, 0, 0.8};
const SetPoint kSetPoints[] = {{0.1, 0, 0}, kStraight, {0, 0, 0.2}, kTurn, {0.5, 0, 0.5}};

struct Outcome {
  double beyond = 0.0;  // longest time beyond the bound [s]
  Fault reported = Fault::none;
};

Outcome drive(const std::string& controller, const Channel& wrong, double scale, const SetPoint& set_point) {
  LoopSetup setup = loadSetup(files(), controller, "ground", {});
  setup.drive.plant_model = assumedModel();
  setup.drive.on_loss = LossPolicyParameters{};
  Faults faults;
  for (const FaultChannel channel : wrong.channels) {
    faults.push_back({FaultKind::scale, channel, scale});
  }
  SetPointProfile profile;
  profile.changes = {{kStart, set_point}};
  profile.duration = 5.0;
  Outcome outcome;
  double since = 0.0, before = 0.0;
  runMonitored(setup, *setup.drive.plant_model, profile, faults, [&](const MonitoredSample& s) {
    const bool beyond = std::abs(s.velocity) > kFactor * std::abs(s.set_point.forward) + kSlack ||
                        std::abs(s.yaw_rate) > kFactor * std::abs(s.set_point.yaw_rate) + kSlack;
    since = beyond ? since + s.time - before : 0.0;
    before = s.time;
    outcome.beyond = std::max(outcome.beyond, since);
    if (s.time < kStart + kReported && outcome.reported == Fault::none) outcome.reported = s.fault;
  });
  return outcome;
}

class WrongFromTheStart : public testing::TestWithParam<const char*> {};

TEST_P(WrongFromTheStart, SensorCostsAtMostHalfOfTheSetPoint) {
  for (const Channel& wrong : {kLeft, kRight, kBoth, kGyro, kAccelerometer}) {
    for (const double scale : {0.0, 1.0 / 3.0, 0.5, 0.7, 1.5, 2.0, 57.3, -1.0}) {
      for (const SetPoint& set_point : kSetPoints) {
        EXPECT_LE(drive(GetParam(), wrong, scale, set_point).beyond, kLongest)
            << wrong.name << " x " << scale << ", " << set_point.forward << " m/s, " << set_point.yaw_rate << " rad/s";
      }
    }
  }
}

TEST_P(WrongFromTheStart, SensorIsReportedWithinTwoSecondsOfMotion) {
  const struct {
    Channel wrong;
    SetPoint set_point;
    std::vector<double> scales;  // that can be known; of 562 m/s^2 at rest an accelerometer never counts
  } rows[] = {{kLeft, kStraight, {0.0, 1.0 / 3.0, 0.5, 2.0, 57.3, -1.0}},
              {kRight, kStraight, {0.0, 1.0 / 3.0, 0.5, 2.0, 57.3, -1.0}},
              {kGyro, kTurn, {0.0, 1.0 / 3.0, 0.5, 2.0, 57.3, -1.0}},
              {kAccelerometer, kStraight, {0.0, 1.0 / 3.0, 0.5, 2.0, -1.0}},
              {kBoth, kStraight, {0.0, 1.0 / 3.0, 2.0, -1.0}}};
  for (const auto& row : rows) {
    for (const double scale : row.scales) {
      EXPECT_STRNE(text(drive(GetParam(), row.wrong, scale, row.set_point).reported), "")
          << row.wrong.name << " x " << scale;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Presets, WrongFromTheStart, testing::Values("predictive", "improved"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace jackal_aic::sim
