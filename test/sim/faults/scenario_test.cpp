// The table of scenarios: what is read, what is refused.

#include "scenario.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace jackal_aic::sim {
namespace {

const std::string kMotions = "motions: {rest: {forward: 0.0}, straight: {forward: 1.0}}\n";

std::string entry(const std::string& body) {
  return kMotions + "scenarios:\n  sample:\n    motions: [rest, straight]\n" + body;
}

const std::string kDrop = "    imu: {kind: drop}\n";
const std::string kExpect = "    expect: {outcome: drives, detected_by: tolerated}\n";

/// Message of the error that a text gives; empty if it gives none.
std::string refusal(const std::string& text) {
  try {
    parseScenarios(text, "file");
    return "";
  } catch (const ParameterError& error) {
    return error.what();
  }
}

TEST(Scenarios, AreReadWithEachMotion) {
  const auto list =
      parseScenarios(entry("    core: [straight]\n    onset: 3\n    imu: {kind: bias, channel: gyro, amount: -0.3, "
                           "start: 0.2, duration: "
                           "0.5}\n    expect: {outcome: stops, within: 0.2, reasons: [gyro, IMU], recovers: false}\n"),
                     "file");
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(list[0].name, "sample/rest");
  EXPECT_FALSE(list[0].core);
  const Scenario& straight = list[1];
  EXPECT_EQ(straight.name, "sample/straight");
  EXPECT_TRUE(straight.core);
  EXPECT_EQ(straight.motion.forward, 1.0);
  ASSERT_EQ(straight.faults.size(), 1u);
  EXPECT_EQ(straight.faults[0].topic, FaultTopic::imu);
  EXPECT_EQ(straight.faults[0].fault.kind, FaultKind::bias);
  EXPECT_EQ(straight.faults[0].fault.channel, FaultChannel::gyro);
  EXPECT_EQ(straight.faults[0].fault.amount, -0.3);
  EXPECT_DOUBLE_EQ(straight.clear(), 3.7);
  EXPECT_DOUBLE_EQ(straight.end(), 5.7);
  EXPECT_EQ(straight.expectation.outcome, Outcome::stops);
  EXPECT_EQ(straight.expectation.reasons, (std::vector<std::string>{"gyro", "IMU"}));
  EXPECT_FALSE(straight.expectation.recovers);
}

TEST(Scenarios, RefuseWhatDoesNotFit) {
  EXPECT_EQ(refusal(entry(kDrop + kExpect)), "");
  EXPECT_NE(refusal(entry(kExpect)).find("sample: has no fault"), std::string::npos);
  EXPECT_NE(refusal(entry(kDrop)).find("expect.outcome"), std::string::npos);
  EXPECT_NE(refusal(entry(kDrop + "    expect: {outcome: drives}\n")).find("reasons: missing"), std::string::npos);
  EXPECT_NE(refusal(entry("    imu: {kind: melt}\n" + kExpect)).find("imu.kind"), std::string::npos);
  EXPECT_NE(refusal(entry("    imu: {kind: drop, shares: 0.5}\n" + kExpect)).find("imu.shares"), std::string::npos);
  EXPECT_NE(refusal(entry("    imu: {kind: drop, share: 2}\n" + kExpect)).find("share = 2"), std::string::npos);
  EXPECT_NE(refusal(entry("    lidar: {kind: drop}\n" + kDrop + kExpect)).find("lidar.kind"), std::string::npos);
  EXPECT_NE(refusal(entry("    imu: {kind: wrong_names}\n" + kExpect)).find("not a fault of this topic"),
            std::string::npos);
  EXPECT_NE(refusal(entry("    set_point: {kind: stamp_zero}\n" + kExpect)).find("not a fault of this topic"),
            std::string::npos);
  EXPECT_NE(refusal(kMotions + "scenarios: {sample: {motions: [fly], imu: {kind: drop}, expect: {outcome: drives, "
                               "detected_by: tolerated}}}")
                .find("'fly'"),
            std::string::npos);
}

TEST(Scenarios, MayChangeTheRobot) {
  const std::string plant = "    plant: {encoder_step: 0.06, support: box, seed: 7}\n";
  const auto list = parseScenarios(entry(plant + kExpect), "file");
  ASSERT_EQ(list.size(), 2u);
  const std::vector<std::pair<std::string, ParameterValue>> expected = {
      {"encoder_step", 0.06}, {"seed", std::int64_t{7}}, {"support", std::string("box")}};
  EXPECT_EQ(list[0].plant, expected);
  EXPECT_DOUBLE_EQ(list[0].clear(), list[0].onset) << "nothing is wrong for a time";
  EXPECT_NE(refusal(entry("    plant: {encoder_step: -1}\n" + kExpect)).find("plant.encoder_step = -1"),
            std::string::npos);
  EXPECT_NE(refusal(entry("    plant: {encoder_steps: 1}\n" + kExpect)).find("plant.encoder_steps"), std::string::npos);
}

/// A fault that stops the robot does so whatever else is wrong, and the earlier of two counts.
TEST(ShippedScenarios, TwoFaultsAtOnceStopTheRobotAsTheSoonerOfThemDoes) {
  const auto list = readScenarios(JACKAL_AIC_SOURCE_DIR "/sim/faults/scenarios.yaml");
  const auto stops_within = [&list](const std::string& name) {
    const auto found =
        std::find_if(list.begin(), list.end(), [&](const Scenario& s) { return s.name.rfind(name + "/", 0) == 0; });
    EXPECT_NE(found, list.end()) << name;
    const bool stops = found != list.end() && found->expectation.outcome == Outcome::stops;
    return stops ? found->expectation.within : std::numeric_limits<double>::infinity();
  };
  int pairs = 0;
  for (const Scenario& scenario : list) {
    const auto plus = scenario.name.find('+');
    if (plus == std::string::npos) continue;
    ++pairs;
    const std::string first = scenario.name.substr(0, plus);
    const std::string second = scenario.name.substr(plus + 1, scenario.name.find('/') - plus - 1);
    const double sooner = std::min(stops_within(first), stops_within(second));
    EXPECT_EQ(scenario.expectation.outcome == Outcome::stops, std::isfinite(sooner)) << scenario.name;
    if (std::isfinite(sooner)) {
      EXPECT_EQ(scenario.expectation.within, sooner) << scenario.name;
    }
    EXPECT_GE(scenario.faults.size() + (scenario.system ? 1 : 0), 2u) << scenario.name;
  }
  EXPECT_EQ(pairs, 12);
}

TEST(ShippedScenarios, CoverWhatTheyHaveTo) {
  const auto list = readScenarios(JACKAL_AIC_SOURCE_DIR "/sim/faults/scenarios.yaml");
  EXPECT_GE(list.size(), 60u);
  std::set<std::string> names, motions;
  std::set<SystemFaultKind> system_faults;
  std::set<FaultKind> message_faults;
  for (const Scenario& scenario : list) {
    EXPECT_TRUE(names.insert(scenario.name).second) << scenario.name << " is there twice";
    motions.insert(scenario.motion.name);
    if (scenario.system) system_faults.insert(scenario.system->kind);
    for (const TopicFault& fault : scenario.faults) message_faults.insert(fault.fault.kind);
  }
  EXPECT_EQ(motions, (std::set<std::string>{"rest", "straight", "turn"}));
  EXPECT_GE(system_faults.size(), kSystemFaultKindNames.size() - 1) << "one side of a blocked motor may stand for both";
  for (std::size_t kind = 0; kind < kFaultKindNames.size(); ++kind) {
    EXPECT_EQ(message_faults.count(static_cast<FaultKind>(kind)), 1u) << kFaultKindNames[kind] << " is never tried";
  }
  EXPECT_GE(std::count_if(list.begin(), list.end(), [](const Scenario& s) { return s.core; }), 10);
}

}  // namespace
}  // namespace jackal_aic::sim
