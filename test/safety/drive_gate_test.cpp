#include "jackal_aic/safety/drive_gate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "../complaint.hpp"
#include "jackal_aic/safety/gate_parameters.hpp"
#include "jackal_aic/safety/input_source.hpp"

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;  // s
const GateParameters kParameters{};
const GeometryParameters kGeometry{};
const SkidSteerKinematics kKinematics(kGeometry);
const double kNaN = std::numeric_limits<double>::quiet_NaN();
const double kInfinity = std::numeric_limits<double>::infinity();

/// An input with a deadline of 0.2 s and one message, which arrived at 1 s.
InputSource received(double stamp) {
  InputSource source(0.2);
  source.receive(stamp, 1.0);
  return source;
}

TEST(InputSource, HasAnInclusiveDeadlineOnBothSidesOfNow) {
  EXPECT_TRUE(InputSource(0.2).health(1.0).missing);
  EXPECT_FALSE(InputSource(0.2).late(1.0));
  for (const double sign : {1.0, -1.0}) {
    EXPECT_FALSE(received(1.0 + sign * 0.2).late(1.0));
    EXPECT_TRUE(received(1.0 + sign * 0.201).late(1.0));
  }
  EXPECT_TRUE(received(kNaN).late(1.0));
  EXPECT_TRUE(received(1.1).late(1.201)) << "by its arrival";
  InputSource any_time(0.0);
  any_time.receive(0.0, 100.0);
  EXPECT_FALSE(any_time.late(200.0));
}

TEST(InputSource, RecoversAfterFiveMessagesInTime) {
  InputSource source = received(1.0);
  for (int i = 0; i <= 5; ++i) {
    source.receive(2.0 + 0.1 * i, 2.0 + 0.1 * i);
    EXPECT_EQ(source.health(2.0 + 0.1 * i).late, i < 5) << i;
  }
}

TEST(StopCauses, WorstCountsAndEachHasAText) {
  StopCauses causes;
  EXPECT_EQ(causes.worst(), StopCause::none);
  causes.add(StopCause::imu_late, true).add(StopCause::emergency_stop, true).add(StopCause::driver_fault, false);
  EXPECT_EQ(causes.worst(), StopCause::emergency_stop);
  for (int i = 1; i < kStopCauses; ++i) EXPECT_STRNE(text(static_cast<StopCause>(i)), "");
}

TEST(Plausibility, BeliefIsBoundedByTheSpeedFactorUnlessThatIsInfinite) {
  GateParameters off;
  off.plausibility.speed_factor = kInfinity;
  const struct {
    BodyVector belief;
    double free_energy;
    bool plausible;
  } rows[] = {{{1.0, 0.0, -3.0}, 12.0, true},  {{-9.9, 9.9, 19.9}, 0.0, true},      {{10.1, 0.0, 0.0}, 0.0, false},
              {{0.0, -10.1, 0.0}, 0.0, false}, {{0.0, 0.0, -20.1}, 0.0, false},     {{kNaN, 0.0, 0.0}, 0.0, false},
              {{0.0, kNaN, 0.0}, 0.0, false},  {{0.0, 0.0, kInfinity}, 0.0, false}, {{0.0, 0.0, 0.0}, kNaN, false}};
  for (const auto& row : rows) {
    EXPECT_EQ(isPlausible(row.belief, row.free_energy, kParameters), row.plausible) << row.belief.transpose();
    EXPECT_TRUE(isPlausible(row.belief, row.free_energy, off)) << row.belief.transpose();
  }
}

TEST(Plausibility, SetPointIsAbsurdBeyondAHundredTimesTheLimits) {
  EXPECT_TRUE(isPlausible(SetPoint{199.0, 0.0, -399.0}, kParameters.limits));
  EXPECT_TRUE(isPlausible(SetPoint{0.0, -199.0, 0.0}, kParameters.limits));
  EXPECT_FALSE(isPlausible(SetPoint{0.0, -201.0, 0.0}, kParameters.limits));
  for (double bad : {1e300, -1e300, kNaN, kInfinity}) {
    for (const SetPoint& set_point : {SetPoint{bad, 0.0, 0.0}, SetPoint{0.0, bad, 0.0}, SetPoint{0.0, 0.0, bad}}) {
      EXPECT_FALSE(isPlausible(set_point, kParameters.limits)) << bad;
    }
  }
}

/// The gate in its order of calls, with an action that asks for one body velocity.
class DriveGateTest : public testing::Test {
 protected:
  static GateInputs with(StopCause cause, bool at_rest = false) { return {StopCauses().add(cause, true), at_rest}; }

  GateDecision step(const GateInputs& inputs) {
    const GateDecision decision = gate.decide(inputs);
    command = decision.status == DriveStatus::driving ? gate.drive(kKinematics.wheelSpeeds(wanted, 0.5 * wanted))
                                                      : gate.brake();
    EXPECT_EQ(command, gate.command());
    return decision;
  }

  GateDecision steps(const GateInputs& inputs, double duration) {
    GateDecision decision;
    for (auto i = std::lround(duration / kPeriod); i > 0; --i) decision = step(inputs);
    return decision;
  }

  static void expect(const GateDecision& decision, DriveStatus status, StopCause cause) {
    EXPECT_EQ(decision.status, status);
    EXPECT_EQ(decision.cause, cause) << text(decision.cause);
  }

  void expectLatched(double duration, DriveStatus status, StopCause cause) {
    const GateDecision decision = steps(clear, duration);
    expect(decision, status, cause);
    EXPECT_TRUE(decision.unacknowledged);
    EXPECT_EQ(command, WheelCommand{});
  }

  double speed() const { return kKinematics.bodyVelocity(command)(kForward); }

  static DriveGate released(const GateParameters& parameters = kParameters) {
    DriveGate gate(parameters, kGeometry, kPeriod);
    gate.release();
    return gate;
  }

  DriveGate gate = released();
  const GateInputs clear{{}, false}, zero{{}, true};
  double wanted = 1.0;  // m/s, and rad/s twice that
  WheelCommand command;
};

TEST_F(DriveGateTest, EmergencyBrakesAtTheHardestLimit) {
  GateParameters decelerates;  // faster than the brake's 3 m/s^2 and its acceleration
  decelerates.limits.linear_acceleration = 2.0;
  decelerates.limits.linear_deceleration = 10.0;
  for (const auto& [parameters, after_three_steps] : {std::pair(kParameters, 0.0), std::pair(decelerates, 0.4)}) {
    gate = released(parameters);
    steps(clear, 1.0);
    ASSERT_NEAR(speed(), 1.0, 1e-9);
    EXPECT_EQ(steps(with(StopCause::emergency_stop), 3 * kPeriod).status, DriveStatus::braking);
    EXPECT_NEAR(speed(), after_three_steps, 1e-9);
    EXPECT_EQ(steps(with(StopCause::emergency_stop), 5.0).status, DriveStatus::stopped);
    EXPECT_EQ(command, WheelCommand{});
  }
}

TEST_F(DriveGateTest, EmergencyHardensABrakeAndNoMilderCauseSoftensIt) {
  steps(clear, 1.0);
  step(with(StopCause::imu_late));
  steps(with(StopCause::emergency_stop), 3 * kPeriod);
  EXPECT_EQ(command, WheelCommand{});
  gate = released();
  wanted = 2.0;
  steps(clear, 1.0);
  const double before = speed();
  step(with(StopCause::emergency_stop));
  const double first = before - speed();
  step(with(StopCause::imu_late));
  EXPECT_NEAR(before - speed(), 2.0 * first, 1e-9);
}

constexpr StopCause kHalts[] = {StopCause::emergency_stop, StopCause::robot_stopped, StopCause::motors_off};

TEST_F(DriveGateTest, HaltWaitsForAZeroSetPointOrAPauseAfterItsRelease) {
  for (const StopCause halt : kHalts) {
    SCOPED_TRACE(text(halt));
    const auto stopAndRelease = [&](bool zero_meanwhile) {
      steps(clear, 1.0);
      steps(with(halt), 0.5);
      steps(with(halt, zero_meanwhile), 0.5);
      steps(with(halt), 0.5);
      expectLatched(5.0, DriveStatus::stopped, halt);
    };
    stopAndRelease(false);
    EXPECT_EQ(step(zero).status, DriveStatus::driving);
    EXPECT_EQ(steps(clear, 0.1).status, DriveStatus::driving);
    stopAndRelease(true);
    EXPECT_EQ(step(with(StopCause::set_point_late, true)).status, DriveStatus::stopped);
    EXPECT_EQ(step(clear).status, DriveStatus::driving);
  }
}

TEST_F(DriveGateTest, HaltIsOverAtOnceIfConfiguredSo) {
  GateParameters parameters;
  parameters.restart_after_stop = RestartPolicy::at_once;
  gate = released(parameters);
  for (const StopCause halt : kHalts) {
    steps(clear, 1.0);
    EXPECT_EQ(steps(with(halt), 1.0).status, DriveStatus::stopped);
    EXPECT_EQ(step(clear).status, DriveStatus::driving);
  }
}

TEST_F(DriveGateTest, FaultWaitsForAZeroSetPointAndOutlastsAStop) {
  for (const bool stopped : {false, true}) {
    steps(clear, 1.0);
    const GateDecision decision = steps(with(StopCause::driver_fault), 1.0);
    EXPECT_EQ(decision.status, DriveStatus::faulted);
    EXPECT_FALSE(decision.unacknowledged);
    if (stopped) steps(with(StopCause::emergency_stop), 2.0);
    expectLatched(5.0, DriveStatus::faulted, StopCause::driver_fault);
    EXPECT_FALSE(step(with(StopCause::driver_fault)).unacknowledged) << "it is back";
    EXPECT_TRUE(steps(clear, 1.5).unacknowledged);
    EXPECT_EQ(step(zero).status, DriveStatus::driving);
    EXPECT_EQ(steps(clear, 0.1).status, DriveStatus::driving);
  }
}

TEST_F(DriveGateTest, FaultHasToBeGoneForASecond) {
  steps(with(StopCause::contention, true), 0.5);
  EXPECT_EQ(steps(zero, 0.9).status, DriveStatus::faulted);
  step(with(StopCause::contention, true));
  EXPECT_EQ(steps(zero, 0.9).status, DriveStatus::faulted) << "it comes and goes";
  EXPECT_EQ(steps(with(StopCause::set_point_missing, true), 0.2).status, DriveStatus::idle);
}

TEST_F(DriveGateTest, ActionThatIsNotFiniteBrakesAsAFault) {
  steps(clear, 1.0);
  ASSERT_EQ(gate.decide(clear).status, DriveStatus::driving);
  const WheelCommand next = gate.drive({kNaN, 1.0});
  EXPECT_LT(next.left, command.left);
  EXPECT_GT(next.left, 0.0) << "not at once";
  command = next;
  expect(step(clear), DriveStatus::braking, StopCause::belief_diverged);
  EXPECT_EQ(steps(clear, 2.0).status, DriveStatus::faulted);
  EXPECT_EQ(step(zero).status, DriveStatus::driving);
}

TEST_F(DriveGateTest, ResetForgetsMotionFaultBrakeAndDivergedAction) {
  steps(clear, 1.0);
  step(with(StopCause::belief_diverged));
  gate.reset();
  EXPECT_EQ(gate.command(), WheelCommand{});
  expectLatched(5.0, DriveStatus::stopped, StopCause::start);
  EXPECT_EQ(step(zero).status, DriveStatus::driving);
  gate.drive({kNaN, 1.0});
  gate.reset();
  gate.release();
  EXPECT_EQ(steps(clear, 1.0).status, DriveStatus::driving);
  step(with(StopCause::emergency_stop));
  gate.reset();
  gate.release();
  steps(clear, 1.0);
  const double before = speed();
  expect(step(with(StopCause::imu_late)), DriveStatus::braking, StopCause::imu_late);
  EXPECT_NEAR(before - speed(), 1.0 / 17.0, 1e-9) << "no emergency any more";
}

std::string refusal(const std::string& key, double value) {
  ParameterMap map;
  map.set(key, value);
  return complaint([&] { readGateParameters(map); });
}

TEST(GateParameters, ZeroDisablesADeadline) {
  for (const char* key : {"deadlines.set_point", "deadlines.wheels", "deadlines.imu", "deadlines.feedback",
                          "deadlines.frozen_wheels", "deadlines.frozen_imu"}) {
    EXPECT_EQ(refusal(key, 0.0), "") << key;
    EXPECT_NE(refusal(key, -0.1).find(key), std::string::npos) << key;
  }
}

TEST(GateParameters, BrakeKeepsAGivenDecelerationAndIsElseFree) {
  const std::pair<const char*, double> fine[] = {{"limits.linear_acceleration", 1.0},
                                                 {"limits.angular_acceleration", 1.0},
                                                 {"brake.linear_deceleration", 21.0},
                                                 {"limits.linear_deceleration", 3.0}};
  for (const auto& [key, value] : fine) EXPECT_EQ(refusal(key, value), "");
  expectSays(refusal("limits.linear_deceleration", 2.5),
             {"brake.linear_deceleration = 3: must be at most limits.linear_deceleration = 2.5"});
  expectSays(refusal("limits.angular_deceleration", 5.0), {"limits.angular_deceleration = 5"});
  ParameterMap map;
  map.set("limits.linear_deceleration", 4.0);
  map.set("brake.time", 0.15);
  EXPECT_THROW(readGateParameters(map), ParameterError) << "2 m/s need 0.5 s";
}

}  // namespace
}  // namespace jackal_aic
