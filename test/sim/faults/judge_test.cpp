// The verdict on recorded runs: every bar can fail.

#include "judge.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "verdict_table.hpp"

namespace jackal_aic::sim {
namespace {

constexpr double kRadius = 0.098;  // m
constexpr double kSpeed = 1.0;     // m/s
constexpr double kOnset = 2.0;     // s

Scenario stopScenario() {
  Scenario scenario;
  scenario.name = "sample/straight";
  scenario.motion = {"straight", kSpeed, 0.0};
  InjectedFault fault;
  fault.duration = 1.6;
  scenario.faults = {{FaultTopic::imu, fault}};
  scenario.expectation.outcome = Outcome::stops;
  scenario.expectation.within = 0.2;
  scenario.expectation.reasons = {"IMU"};
  scenario.expectation.recovers = false;
  return scenario;
}

/// A run at constant speed until `stop`, then a ramp of `deceleration` to zero, by robot and command alike.
RunRecord braking(double stop, double deceleration) {
  RunRecord record;
  for (int k = 0; k <= 280; ++k) {
    const double time = 0.02 * k;
    const double speed = time < stop ? kSpeed : std::max(0.0, kSpeed - deceleration * (time - stop));
    record.truth.push_back({time, speed, 0.0});
    record.commands.push_back({time, {speed / kRadius, speed / kRadius}});
    const bool driving = time < stop;
    record.states.push_back({time, driving, driving ? "driving" : "braking: IMU data too old", 0, 0});
  }
  return record;
}

bool mentions(const Verdict& verdict, const std::string& word) {
  return std::any_of(verdict.failures.begin(), verdict.failures.end(),
                     [&](const std::string& failure) { return failure.find(word) != std::string::npos; });
}

TEST(Judge, PassesAStopInTime) {
  const Verdict verdict = judge(stopScenario(), braking(kOnset + 0.2, 2.0), CampaignLimits{});
  EXPECT_TRUE(verdict.passed()) << (verdict.passed() ? "" : verdict.failures[0]);
  EXPECT_NEAR(*verdict.standstill, 0.7, 0.021);
  EXPECT_NEAR(*verdict.detected_after, 0.2, 0.021);
  EXPECT_EQ(verdict.told, "braking: IMU data too old");
  EXPECT_EQ(verdict.history, "0.00 s driving, 2.20 s braking: IMU data too old");
  EXPECT_NEAR(verdict.distance, 0.2 + 0.25, 0.03);
  EXPECT_NEAR(verdict.command_step, 0.04 / kRadius, 1e-6);
  EXPECT_NEAR(verdict.acceleration_use, 2.0 / 20.0, 1e-6);
  EXPECT_NEAR(verdict.limit_use, 0.5, 1e-6);
}

TEST(Judge, AllowsTheConfiguredTimeAndAFifthAndTheRobotsOwn) {
  CampaignLimits limits;
  Expectation expectation;
  expectation.within = 0.2;
  EXPECT_NEAR(allowedStandstill(expectation, limits, {0.0, 1.65, 0.0}), 1.2 * (0.2 + 1.0) + 0.08, 1e-9);
  // The gate's brake counts where it is slower than the robot.
  limits.robot_acceleration = 100.0;
  EXPECT_NEAR(allowedStandstill(expectation, limits, {0.0, 1.5, 0.0}), 1.2 * (0.2 + 0.5) + 0.08, 1e-9);
  EXPECT_NEAR(allowedStandstill(expectation, limits, {0.0, 0.0, 1.5}), 1.2 * (0.2 + 0.25) + 0.08, 1e-9);
  EXPECT_NEAR(allowedStandstill(expectation, limits, {0.0, 30.0, 0.0}), 1.2 * (0.2 + 1.0) + 0.08, 1e-9);
}

TEST(Judge, FailsALateStop) {
  const Verdict verdict = judge(stopScenario(), braking(kOnset + 0.9, 2.0), CampaignLimits{});
  EXPECT_TRUE(mentions(verdict, "standstill after"));
}

TEST(Judge, FailsADriveOn) {
  const Verdict verdict = judge(stopScenario(), braking(100.0, 2.0), CampaignLimits{});
  EXPECT_TRUE(mentions(verdict, "does not stop"));
  EXPECT_TRUE(mentions(verdict, "undetected"));
  EXPECT_TRUE(mentions(verdict, "at the end"));
}

TEST(Judge, FailsARunThatNeverGotGoing) {
  RunRecord record = braking(0.0, 1000.0);
  for (StateSample& state : record.states) state.driving = state.time < kOnset;
  EXPECT_TRUE(mentions(judge(stopScenario(), record, CampaignLimits{}), "at the onset"));
}

TEST(Judge, FailsAStopThatDoesNotLast) {
  RunRecord record = braking(kOnset + 0.2, 2.0);
  for (TruthSample& sample : record.truth) {
    if (sample.time > 3.3 && sample.time < 3.4) sample.forward = 0.1;
  }
  EXPECT_TRUE(mentions(judge(stopScenario(), record, CampaignLimits{}), "standstill after"));
}

TEST(Judge, FailsAJumpOfTheCommand) {
  const Verdict verdict = judge(stopScenario(), braking(kOnset + 0.2, 1000.0), CampaignLimits{});
  EXPECT_TRUE(mentions(verdict, "steps by"));
  EXPECT_NEAR(verdict.command_step, kSpeed / kRadius, 1e-6);
}

TEST(Judge, FailsACommandBeyondTheLimits) {
  RunRecord record = braking(kOnset + 0.2, 2.0);
  for (std::size_t i = 0; i < 90; ++i) record.commands[i].speeds = {2.1 / kRadius, 2.1 / kRadius};
  EXPECT_TRUE(mentions(judge(stopScenario(), record, CampaignLimits{}), "of the limits"));
  record = braking(kOnset + 0.2, 2.0);
  record.commands[3].speeds.right = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(mentions(judge(stopScenario(), record, CampaignLimits{}), "not finite"));
}

// Whatever a scenario excuses: the soak runs on after a bar that a random sequence misses, but not after these.
TEST(Judge, TellsWhatNoFaultExcusesApart) {
  const auto unsound = [](const RunRecord& record) { return judge(stopScenario(), record, CampaignLimits{}).unsound; };
  const RunRecord late = braking(kOnset + 0.9, 2.0);
  EXPECT_FALSE(judge(stopScenario(), late, CampaignLimits{}).passed());
  EXPECT_TRUE(unsound(late).empty());
  EXPECT_EQ(unsound(RunRecord{}), std::vector<std::string>{"nothing was recorded"});
  RunRecord record = late;
  record.breakdown = "the controller died";
  EXPECT_EQ(unsound(record), std::vector<std::string>{"the controller died"});
  record = late;
  record.commands[3].speeds.right = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(unsound(record), std::vector<std::string>{"a drive command is not finite"});
  record = late;
  record.commands.back().fresh_start = true;
  record.commands.back().speeds = {1.0, 1.0};
  EXPECT_EQ(unsound(record), std::vector<std::string>{"an old motion goes on after a fresh start"});
  EXPECT_EQ(unsound(braking(kOnset + 0.2, 1000.0)).size(), 1u) << "a step";
  for (CommandSample& sample : record.commands) sample.speeds = {2.1 / kRadius, 2.1 / kRadius};
  EXPECT_NE(unsound(record).back().find("of the limits"), std::string::npos);
}

TEST(Judge, FailsOverspeed) {
  RunRecord record = braking(kOnset + 0.2, 2.0);
  for (TruthSample& sample : record.truth) {
    if (sample.time > 2.05 && sample.time < 2.15) sample.forward = -1.4;
  }
  const Verdict verdict = judge(stopScenario(), record, CampaignLimits{});
  EXPECT_TRUE(mentions(verdict, "overspeed 0.40"));
}

TEST(Judge, FailsASpin) {
  RunRecord record = braking(kOnset + 0.2, 2.0);
  for (TruthSample& sample : record.truth) {
    if (sample.time > 2.05 && sample.time < 2.15) sample.yaw_rate = -3.0;
  }
  EXPECT_TRUE(mentions(judge(stopScenario(), record, CampaignLimits{}), "yaw rate 3.00"));
}

TEST(Judge, FailsAnInterruptionWhereNoneMayBe) {
  Scenario scenario = stopScenario();
  scenario.expectation.outcome = Outcome::drives;
  scenario.expectation.detected_by = Detection::tolerated;
  RunRecord record = braking(100.0, 2.0);
  EXPECT_TRUE(judge(scenario, record, CampaignLimits{}).passed());
  record.states[120].driving = false;
  EXPECT_TRUE(mentions(judge(scenario, record, CampaignLimits{}), "interrupted"));
  scenario.expectation.outcome = Outcome::resumes;
  EXPECT_TRUE(judge(scenario, record, CampaignLimits{}).passed());
}

TEST(Judge, FailsAFaultThatLatchesWhereTheDriveHasToResume) {
  Scenario scenario = stopScenario();
  scenario.expectation.outcome = Outcome::resumes;
  scenario.expectation.detected_by = Detection::tolerated;
  RunRecord record = braking(100.0, 2.0);
  ASSERT_TRUE(judge(scenario, record, CampaignLimits{}).passed());
  record.states[120].text = "faulted: sensors faulty";
  EXPECT_TRUE(mentions(judge(scenario, record, CampaignLimits{}), "latched: 'faulted: sensors faulty'"));
  record = braking(100.0, 2.0);
  record.states.back().driving = false;
  EXPECT_TRUE(mentions(judge(scenario, record, CampaignLimits{}), "does not drive at the end"));
}

TEST(Judge, CountsRejectedMessagesSinceTheOnset) {
  Scenario scenario = stopScenario();
  scenario.expectation.outcome = Outcome::drives;
  scenario.expectation.detected_by = Detection::set_points;
  RunRecord record = braking(100.0, 2.0);
  for (StateSample& state : record.states) state.rejected_set_points = 5;
  EXPECT_TRUE(mentions(judge(scenario, record, CampaignLimits{}), "undetected")) << "those of an earlier run";
  for (StateSample& state : record.states) state.rejected_set_points = state.time > 2.3 ? 7 : 5;
  const Verdict verdict = judge(scenario, record, CampaignLimits{});
  EXPECT_TRUE(verdict.passed());
  EXPECT_NEAR(*verdict.detected_after, 0.3, 0.03);
}

TEST(Judge, FailsALateDetection) {
  Scenario scenario = stopScenario();
  scenario.expectation.detected_within = 0.3;
  EXPECT_TRUE(judge(scenario, braking(kOnset + 0.2, 2.0), CampaignLimits{}).passed());
  scenario.expectation.detected_within = 0.15;
  EXPECT_TRUE(mentions(judge(scenario, braking(kOnset + 0.2, 2.0), CampaignLimits{}), "told after"));
}

TEST(Judge, ReadsDiagnostics) {
  Scenario scenario = stopScenario();
  scenario.expectation.outcome = Outcome::drives;
  scenario.expectation.detected_by = Detection::diagnostics;
  RunRecord record = braking(100.0, 2.0);
  record.diagnostics = {{1.0, "IMU"}, {2.4, "wheels"}};
  EXPECT_TRUE(mentions(judge(scenario, record, CampaignLimits{}), "undetected"));
  record.diagnostics.push_back({2.5, "IMU excluded"});
  EXPECT_TRUE(judge(scenario, record, CampaignLimits{}).passed());
}

TEST(Judge, ANewProcessStartsFromZero) {
  Scenario scenario = stopScenario();
  RunRecord record = braking(kOnset + 0.2, 2.0);
  for (CommandSample& command : record.commands) {
    if (command.time > 2.2) command.speeds = {};
  }
  EXPECT_TRUE(mentions(judge(scenario, record, CampaignLimits{}), "steps by"));
  const auto fresh = std::find_if(record.commands.begin(), record.commands.end(),
                                  [](const CommandSample& command) { return command.time > 2.2; });
  ASSERT_NE(fresh, record.commands.end());
  fresh->fresh_start = true;
  EXPECT_TRUE(judge(scenario, record, CampaignLimits{}).passed());
  for (CommandSample& command : record.commands) {
    if (command.time > 2.2 && command.time < 2.3) command.speeds = {3.0, 3.0};
  }
  EXPECT_TRUE(mentions(judge(scenario, record, CampaignLimits{}), "old motion"));
}

TEST(VerdictTable, ARowIsOneLineWhateverWasTold) {
  Verdict verdict;
  verdict.told = "one\ntwo, \"three\"";
  const std::string row = verdictLine(stopScenario(), verdict);
  EXPECT_EQ(std::count(row.begin(), row.end(), '\n'), 1);
  EXPECT_EQ(row.back(), '\n');
  EXPECT_NE(row.find("\"one two, \"\"three\"\"\""), std::string::npos) << row;
}

TEST(Judge, FailsABreakdown) {
  RunRecord record = braking(kOnset + 0.2, 2.0);
  record.breakdown = "the controller crashed";
  EXPECT_TRUE(mentions(judge(stopScenario(), record, CampaignLimits{}), "crashed"));
  EXPECT_TRUE(mentions(judge(stopScenario(), {}, CampaignLimits{}), "nothing was recorded"));
}

}  // namespace
}  // namespace jackal_aic::sim
