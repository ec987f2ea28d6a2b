#include "jackal_aic/safety/drive_gate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace jackal_aic {
namespace {

constexpr double kPeriod = 0.02;  // s
const DeadlineParameters kDeadlines{};
const GateParameters kParameters{};
const GeometryParameters kGeometry{};
const SkidSteerKinematics kKinematics(kGeometry);
const double kNaN = std::numeric_limits<double>::quiet_NaN();
const double kInfinity = std::numeric_limits<double>::infinity();

InputAges fresh() { return {0.1, 0.02, 0.02, 0.02, kNever}; }

StopCause overdue(const InputAges& ages, const DeadlineParameters& deadlines = kDeadlines) {
  return overdueInputs(ages, deadlines).add(lossCauses(sensorHealth(ages, deadlines))).worst();
}

TEST(OverdueInputs, FreshOnesHaveNoCause) {
  EXPECT_EQ(overdue(fresh()), StopCause::none);
  InputAges ages = fresh();
  ages.feedback = 0.02;
  EXPECT_EQ(overdue(ages), StopCause::none);
}

TEST(OverdueInputs, NothingReceivedIsForemostNoSetPoint) { EXPECT_EQ(overdue({}), StopCause::set_point_missing); }

/// Where network and rates delay the samples, the last pair is older than the last sample of a source that falls
/// silent.
TEST(OverdueInputs, PairsThatEndWithASilentSourceAreNoOtherCause) {
  for (double InputAges::*silent : {&InputAges::imu, &InputAges::wheels}) {
    InputAges ages = fresh();
    ages.*silent = 0.19;
    ages.measurement = 0.23;
    ages.unpaired = 0.0;
    EXPECT_EQ(overdue(ages), StopCause::none);
    ages.*silent = 0.201;
    EXPECT_NE(overdue(ages), StopCause::unpaired);
    EXPECT_NE(overdue(ages), StopCause::none);
  }
}

/// Of a source with the period of its deadline the last pair is older than that until the next one is known.
TEST(OverdueInputs, APairThatIsOnItsWayIsNoOtherCause) {
  InputAges ages = fresh();
  ages.measurement = 0.23;
  ages.unpaired = 0.03;
  EXPECT_EQ(overdue(ages), StopCause::none);
  ages.unpaired = 0.11;
  EXPECT_EQ(overdue(ages), StopCause::unpaired);
}

TEST(OverdueInputs, EachHasItsOwnInclusiveDeadlineOnBothSidesOfNow) {
  struct Case {
    double InputAges::*input;
    double deadline;
    StopCause cause;
  };
  for (const Case& c :
       {Case{&InputAges::set_point, 0.5, StopCause::set_point_late},
        Case{&InputAges::wheels, 0.2, StopCause::wheels_late}, Case{&InputAges::imu, 0.2, StopCause::imu_late},
        Case{&InputAges::feedback, 0.2, StopCause::feedback_late},
        Case{&InputAges::measurement, 0.2, StopCause::unpaired}}) {
    for (double sign : {1.0, -1.0}) {
      InputAges ages = fresh();
      ages.*c.input = sign * c.deadline;
      EXPECT_EQ(overdue(ages), StopCause::none) << text(c.cause);
      ages.*c.input = sign * (c.deadline + 0.001);
      EXPECT_EQ(overdue(ages), c.cause);
    }
    InputAges ages = fresh();
    ages.*c.input = kNaN;
    EXPECT_EQ(overdue(ages), c.cause) << "an age that is no number";
  }
}

TEST(OverdueInputs, WhatNeverCameStopsButForTheFeedback) {
  for (const auto& [input, cause] :
       {std::pair(&InputAges::wheels, StopCause::wheels_missing), std::pair(&InputAges::imu, StopCause::imu_missing),
        std::pair(&InputAges::measurement, StopCause::unpaired), std::pair(&InputAges::feedback, StopCause::none)}) {
    InputAges ages = fresh();
    ages.*input = kNever;
    EXPECT_EQ(overdue(ages), cause);
  }
}

TEST(OverdueInputs, ZeroSwitchesADeadlineOff) {
  const InputAges old{100.0, 100.0, 100.0, 100.0, 100.0};
  EXPECT_EQ(overdue(old, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0}), StopCause::none);
  EXPECT_EQ(overdue(old, {0.0, 0.2, 0.0, 0.0, 0.0, 0.0}), StopCause::wheels_late);
}

TEST(OverdueInputs, APairIsAsLateAsTheMorePatientOfItsTwoDeadlinesAllows) {
  struct Case {
    double wheels, imu, age;
    StopCause cause;
  };
  // Where one of the two is never late, a pair is not.
  for (const Case& c : {Case{0.2, 0.6, 0.6, StopCause::none}, Case{0.6, 0.2, 0.6, StopCause::none},
                        Case{0.2, 0.6, 0.601, StopCause::unpaired}, Case{0.6, 0.2, 0.601, StopCause::unpaired},
                        Case{0.2, 0.0, 100.0, StopCause::none}, Case{0.0, 0.2, 100.0, StopCause::none}}) {
    DeadlineParameters deadlines;
    deadlines.wheels = c.wheels;
    deadlines.imu = c.imu;
    InputAges ages = fresh();
    ages.measurement = c.age;
    EXPECT_EQ(overdue(ages, deadlines), c.cause) << c.wheels << ", " << c.imu << ", " << c.age;
  }
}

TEST(StopCauses, TheLastOneCountsAndEachHasAText) {
  StopCauses causes;
  EXPECT_EQ(causes.worst(), StopCause::none);
  causes.add(StopCause::imu_late, true).add(StopCause::emergency_stop, true).add(StopCause::driver_fault, false);
  EXPECT_EQ(causes.worst(), StopCause::emergency_stop);
  for (int i = 1; i < kStopCauses; ++i) EXPECT_STRNE(text(static_cast<StopCause>(i)), "");
}

TEST(BeliefWatchdog, KnowsAPlausibleBelief) {
  EXPECT_TRUE(isPlausible({1.0, 0.0, -3.0}, 12.0, kParameters));
  EXPECT_TRUE(isPlausible({-9.9, 9.9, 19.9}, 0.0, kParameters));
  for (const BodyVector& belief : {BodyVector(10.1, 0, 0), BodyVector(0, -10.1, 0), BodyVector(0, 0, -20.1),
                                   BodyVector(kNaN, 0, 0), BodyVector(0, kNaN, 0), BodyVector(0, 0, kInfinity)}) {
    EXPECT_FALSE(isPlausible(belief, 0.0, kParameters)) << belief.transpose();
  }
  EXPECT_FALSE(isPlausible({0.0, 0.0, 0.0}, kNaN, kParameters));
}

TEST(BeliefWatchdog, AnInfiniteFactorSwitchesItOff) {
  GateParameters parameters;
  parameters.plausibility.speed_factor = kInfinity;
  EXPECT_TRUE(isPlausible({1e6, kNaN, -kInfinity}, kNaN, parameters));
}

TEST(SetPointPlausibility, TooFastIsScaledButAbsurdIsRefused) {
  EXPECT_TRUE(isPlausible(SetPoint{199.0, 0.0, -399.0}, kParameters.limits));
  EXPECT_TRUE(isPlausible(SetPoint{0.0, -199.0, 0.0}, kParameters.limits));
  EXPECT_FALSE(isPlausible(SetPoint{0.0, -201.0, 0.0}, kParameters.limits));
  for (double bad : {1e300, -1e300, kNaN, kInfinity}) {
    EXPECT_FALSE(isPlausible(SetPoint{bad, 0.0, 0.0}, kParameters.limits)) << bad;
    EXPECT_FALSE(isPlausible(SetPoint{0.0, bad, 0.0}, kParameters.limits)) << bad;
    EXPECT_FALSE(isPlausible(SetPoint{0.0, 0.0, bad}, kParameters.limits)) << bad;
  }
}

/// The gate in its order of calls, with an action that asks for one body velocity.
class DriveGateTest : public testing::Test {
 protected:
  static GateInputs with(StopCause cause, bool at_rest = false) { return {StopCauses().add(cause, true), at_rest}; }

  GateDecision step(const GateInputs& inputs) {
    const GateDecision decision = gate.decide(inputs);
    const WheelCommand before = command;
    command = decision.status == DriveStatus::driving
                  ? gate.drive(kKinematics.wheelSpeeds(wanted, 0.5 * wanted), {wanted, 0.0, 0.5 * wanted})
                  : gate.brake();
    EXPECT_EQ(command, gate.command());
    largest_jump =
        std::max({largest_jump, std::abs(command.left - before.left), std::abs(command.right - before.right)});
    return decision;
  }

  GateDecision steps(const GateInputs& inputs, double duration) {
    GateDecision decision;
    for (auto i = std::lround(duration / kPeriod); i > 0; --i) decision = step(inputs);
    return decision;
  }

  double speed() const { return kKinematics.bodyVelocity(command)(kForward); }

  /// A gate whose latch of the start is released.
  static DriveGate released(const GateParameters& parameters = kParameters) {
    DriveGate gate(parameters, kGeometry, kPeriod);
    gate.release();
    return gate;
  }

  DriveGate gate = released();
  const GateInputs clear{{}, false};
  double wanted = 1.0;  // m/s, and rad/s twice that
  WheelCommand command;
  double largest_jump = 0.0;
};

TEST_F(DriveGateTest, IsIdleUntilASetPointComes) {
  EXPECT_EQ(step(with(StopCause::set_point_missing)).status, DriveStatus::idle);
  EXPECT_EQ(command, WheelCommand{});
  const GateDecision decision = step(clear);
  EXPECT_EQ(decision.status, DriveStatus::driving);
  EXPECT_EQ(gate.decide(clear).cause, StopCause::none);
}

TEST_F(DriveGateTest, BrakesToZeroAndStopsAndStartsAgain) {
  steps(clear, 1.0);
  ASSERT_NEAR(speed(), 1.0, 1e-9);
  GateDecision decision = step(with(StopCause::imu_late));
  EXPECT_EQ(decision.status, DriveStatus::braking);
  EXPECT_EQ(decision.cause, StopCause::imu_late);
  EXPECT_NEAR(speed(), 1.0 - 1.0 / 17.0, 1e-9) << "slows down in the first step, 1 m/s at 3 m/s^2 in 17 of them";
  decision = steps(with(StopCause::imu_late), 16 * kPeriod);
  EXPECT_EQ(decision.status, DriveStatus::braking);
  EXPECT_EQ(command, WheelCommand{});
  decision = step(with(StopCause::imu_late));
  EXPECT_EQ(decision.status, DriveStatus::stopped);
  EXPECT_EQ(decision.cause, StopCause::imu_late);

  decision = step(clear);
  EXPECT_EQ(decision.status, DriveStatus::driving);
  EXPECT_NEAR(speed(), 0.4, 1e-9) << "from zero, at the acceleration limit";
}

TEST_F(DriveGateTest, ABrakeIsCarriedThroughAlthoughItsCauseIsGone) {
  steps(clear, 1.0);
  step(with(StopCause::wheels_late));
  double last = speed();
  for (int i = 0; i < 16; ++i) {
    const GateDecision decision = step(clear);
    EXPECT_EQ(decision.status, DriveStatus::braking) << i;
    EXPECT_EQ(decision.cause, StopCause::wheels_late);
    EXPECT_LT(speed(), last);
    last = speed();
  }
  EXPECT_EQ(command, WheelCommand{});
  EXPECT_EQ(step(clear).status, DriveStatus::driving);
}

TEST_F(DriveGateTest, AtRestACauseStopsWithoutABrake) {
  wanted = 0.0;
  steps(clear, 0.1);
  EXPECT_EQ(step(with(StopCause::set_point_late)).status, DriveStatus::stopped);
}

TEST_F(DriveGateTest, AnEmergencyStopBrakesAtTheAccelerationLimit) {
  steps(clear, 1.0);
  EXPECT_EQ(steps(with(StopCause::emergency_stop), 3 * kPeriod).status, DriveStatus::braking);
  EXPECT_EQ(command, WheelCommand{}) << "1 m/s at 20 m/s^2 within 3 steps";
  EXPECT_EQ(step(with(StopCause::emergency_stop)).status, DriveStatus::stopped);
  EXPECT_EQ(steps(with(StopCause::emergency_stop), 5.0).status, DriveStatus::stopped);
}

TEST_F(DriveGateTest, AnEmergencyStopBrakesAtTheDecelerationLimitWhereThereIsOne) {
  GateParameters parameters;
  parameters.limits.linear_acceleration = 2.0;
  parameters.limits.linear_deceleration = 10.0;
  gate = released(parameters);
  steps(clear, 1.0);
  ASSERT_NEAR(speed(), 1.0, 1e-9);
  steps(with(StopCause::emergency_stop), 4 * kPeriod);
  EXPECT_NEAR(speed(), 0.2, 1e-9) << "harder than the brake's 3 m/s^2 and the 2 m/s^2 it drives with";
  step(with(StopCause::emergency_stop));
  EXPECT_EQ(command, WheelCommand{});
}

class StopBySomebody : public DriveGateTest, public testing::WithParamInterface<StopCause> {
 protected:
  /// From 1 m/s to rest by the stop, which is over afterwards while the set point goes on.
  void stopAndRelease() {
    steps(clear, 1.0);
    steps(with(GetParam()), 1.0);
    const GateDecision decision = steps(clear, 5.0);
    EXPECT_EQ(decision.status, DriveStatus::stopped) << "the release alone must not set it off again";
    EXPECT_EQ(decision.cause, GetParam());
    EXPECT_TRUE(decision.unacknowledged);
    EXPECT_EQ(command, WheelCommand{});
  }
};

TEST_P(StopBySomebody, WaitsForAZeroSetPointAfterItsRelease) {
  stopAndRelease();
  EXPECT_EQ(step({{}, true}).status, DriveStatus::driving);
  EXPECT_EQ(steps(clear, 0.1).status, DriveStatus::driving);
}

TEST_P(StopBySomebody, WaitsForASetPointAfterAPause) {
  stopAndRelease();
  EXPECT_EQ(step(with(StopCause::set_point_late, true)).status, DriveStatus::stopped);
  EXPECT_EQ(step(clear).status, DriveStatus::driving);
}

TEST_P(StopBySomebody, AZeroSetPointBeforeItsReleaseIsNoAcknowledgement) {
  steps(clear, 1.0);
  steps(with(GetParam()), 0.5);
  steps(with(GetParam(), true), 0.5);
  steps(with(GetParam()), 0.5);
  EXPECT_EQ(steps(clear, 1.0).status, DriveStatus::stopped);
}

TEST_P(StopBySomebody, IsOverAtOnceIfConfiguredSo) {
  GateParameters parameters;
  parameters.restart_after_stop = RestartPolicy::at_once;
  gate = released(parameters);
  steps(clear, 1.0);
  EXPECT_EQ(steps(with(GetParam()), 1.0).status, DriveStatus::stopped);
  EXPECT_EQ(step(clear).status, DriveStatus::driving);
}

INSTANTIATE_TEST_SUITE_P(Causes, StopBySomebody,
                         testing::Values(StopCause::emergency_stop, StopCause::robot_stopped, StopCause::motors_off),
                         [](const auto& info) { return "cause_" + std::to_string(static_cast<int>(info.param)); });

TEST_F(DriveGateTest, AFaultOutlastsAStopBySomebody) {
  steps(with(StopCause::driver_fault), 0.5);
  steps(with(StopCause::emergency_stop), 2.0);
  const GateDecision decision = step(clear);
  EXPECT_EQ(decision.status, DriveStatus::faulted);
  EXPECT_EQ(decision.cause, StopCause::driver_fault);
  EXPECT_EQ(step({{}, true}).status, DriveStatus::driving) << "one zero set point acknowledges both";
}

TEST_F(DriveGateTest, AMilderCauseDoesNotSoftenAnEmergencyBrake) {
  wanted = 2.0;
  steps(clear, 1.0);
  const double before = speed();
  step(with(StopCause::emergency_stop));
  const double first = before - speed();
  step(with(StopCause::imu_late));
  EXPECT_NEAR(before - speed(), 2.0 * first, 1e-9);
}

TEST_F(DriveGateTest, AnEmergencyHardensABrake) {
  steps(clear, 1.0);
  step(with(StopCause::imu_late));
  steps(with(StopCause::emergency_stop), 3 * kPeriod);
  EXPECT_EQ(command, WheelCommand{});
}

TEST_F(DriveGateTest, AFaultWaitsForAZeroSetPointAfterItIsGone) {
  steps(clear, 1.0);
  GateDecision decision = steps(with(StopCause::driver_fault), 1.0);
  EXPECT_EQ(decision.status, DriveStatus::faulted);
  EXPECT_FALSE(decision.unacknowledged);
  decision = steps(clear, 5.0);
  EXPECT_EQ(decision.status, DriveStatus::faulted) << "the old set point must not set it off again";
  EXPECT_EQ(decision.cause, StopCause::driver_fault);
  EXPECT_TRUE(decision.unacknowledged);
  EXPECT_EQ(command, WheelCommand{});

  wanted = 0.0;
  EXPECT_EQ(step({{}, true}).status, DriveStatus::driving);
  wanted = 1.0;
  EXPECT_EQ(steps(clear, 0.1).status, DriveStatus::driving);
}

TEST_F(DriveGateTest, AFaultMustBeGoneForAWhile) {
  steps(with(StopCause::contention, true), 0.5);
  EXPECT_EQ(steps({{}, true}, 0.9).status, DriveStatus::faulted);
  step(with(StopCause::contention, true));
  EXPECT_EQ(steps({{}, true}, 0.9).status, DriveStatus::faulted) << "comes and goes";
  EXPECT_EQ(steps(with(StopCause::set_point_missing, true), 0.2).status, DriveStatus::idle);
}

TEST_F(DriveGateTest, AnActionThatIsNotFiniteBrakesAndIsAFault) {
  steps(clear, 1.0);
  ASSERT_EQ(gate.decide(clear).status, DriveStatus::driving);
  const WheelCommand next = gate.drive({kNaN, 1.0}, {});
  EXPECT_LT(next.left, command.left);
  EXPECT_GT(next.left, 0.0) << "not at once";
  command = next;
  const GateDecision decision = step(clear);
  EXPECT_EQ(decision.status, DriveStatus::braking);
  EXPECT_EQ(decision.cause, StopCause::belief_diverged);
  EXPECT_EQ(steps(clear, 1.0).status, DriveStatus::faulted);
}

TEST_F(DriveGateTest, AnActionThatIsFiniteAgainIsAcknowledgedLikeAnyFault) {
  steps(clear, 1.0);
  ASSERT_EQ(gate.decide(clear).status, DriveStatus::driving);
  gate.drive({kNaN, 1.0}, {});
  ASSERT_EQ(steps(clear, 2.0).status, DriveStatus::faulted);
  EXPECT_EQ(step({{}, true}).status, DriveStatus::driving);
}

TEST_F(DriveGateTest, AFaultThatComesBackIsNoLongerWaitingForAnAcknowledgement) {
  steps(with(StopCause::driver_fault), 0.5);
  ASSERT_TRUE(steps(clear, 0.5).unacknowledged);
  EXPECT_FALSE(step(with(StopCause::driver_fault)).unacknowledged);
  EXPECT_TRUE(step(clear).unacknowledged);
}

TEST_F(DriveGateTest, ResetForgetsMotionAndFaultAndLatches) {
  steps(clear, 1.0);
  steps(with(StopCause::belief_diverged), 0.02);
  gate.reset();
  EXPECT_EQ(gate.command(), WheelCommand{});
  const GateDecision decision = steps(clear, 5.0);
  EXPECT_EQ(decision.status, DriveStatus::stopped);
  EXPECT_EQ(decision.cause, StopCause::start);
  EXPECT_TRUE(decision.unacknowledged);
  EXPECT_EQ(step({{}, true}).status, DriveStatus::driving);
}

TEST_F(DriveGateTest, IsLatchedFromTheStartWhateverSetsItMovingAfterAStop) {
  GateParameters parameters;
  parameters.restart_after_stop = RestartPolicy::at_once;
  gate = DriveGate(parameters, kGeometry, kPeriod);
  EXPECT_EQ(steps(clear, 5.0).cause, StopCause::start);
  EXPECT_EQ(steps(with(StopCause::emergency_stop), 1.0).cause, StopCause::emergency_stop)
      << "what is wrong is told first";
  EXPECT_EQ(steps(clear, 5.0).cause, StopCause::start);
  EXPECT_EQ(step(with(StopCause::set_point_missing, true)).status, DriveStatus::idle);
  EXPECT_EQ(step(clear).status, DriveStatus::driving);
}

TEST_F(DriveGateTest, ReleasesTheLatchOfTheStartAlone) {
  steps(with(StopCause::emergency_stop), 1.0);
  gate.release();
  EXPECT_EQ(step(clear).cause, StopCause::emergency_stop);
}

TEST_F(DriveGateTest, ResetForgetsABrakeAndAnActionThatWasNotFinite) {
  steps(clear, 1.0);
  step(with(StopCause::emergency_stop));
  gate.reset();
  gate.release();
  steps(clear, 1.0);
  const double before = speed();
  const GateDecision braking = step(with(StopCause::imu_late));
  EXPECT_EQ(braking.cause, StopCause::imu_late);
  EXPECT_NEAR(before - speed(), 1.0 / 17.0, 1e-9) << "no emergency any more";

  ASSERT_EQ(steps(clear, 1.0).status, DriveStatus::driving);
  gate.drive({kNaN, 1.0}, {});
  gate.reset();
  gate.release();
  EXPECT_EQ(step(clear).status, DriveStatus::driving);
}

TEST_F(DriveGateTest, NoSequenceOfCausesMakesTheCommandJump) {
  const double largest_step = kKinematics.wheelSpeeds(20.0 * kPeriod, 25.0 * kPeriod).right;
  unsigned state = 1;
  for (int i = 0; i < 20000; ++i) {
    state = 1664525u * state + 1013904223u;
    wanted = 2.0 * std::sin(0.001 * i);
    const int cause = static_cast<int>((state >> 8) % (8 * kStopCauses));  // mostly none
    step(cause < kStopCauses ? with(static_cast<StopCause>(cause), cause % 2 == 0) : GateInputs{{}, state % 64 == 0});
    ASSERT_LE(std::abs(speed()), 2.0 + 1e-9);
  }
  EXPECT_LE(largest_jump, largest_step + 1e-9);
  EXPECT_GT(largest_jump, 0.0);
}

}  // namespace
}  // namespace jackal_aic
