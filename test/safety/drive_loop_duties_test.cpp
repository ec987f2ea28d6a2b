// The calls that a drive loop makes to its controller, and its answers to its caller.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "jackal_aic/safety/drive_loop.hpp"

namespace jackal_aic {
namespace {

constexpr double kTick = 0.001;                            // s
constexpr double kPeriod = 0.02;                           // s
constexpr double kLargestChange = 20.0 * kPeriod / 0.098;  // rad/s, of a command in a period
constexpr ChannelValidity kWheels{false, true, true, false}, kImu{true, false, false, true};

/// Wants the command it is set to, and records its calls.
class ScriptedController : public VelocityController {
 public:
  bool setSetPoint(const SetPoint& set_point) override {
    set_point_ = set_point;
    return true;
  }
  SampleVerdict observe(const Observation& observation) override {
    if (observation.stamp <= last.stamp) return SampleVerdict::stale;
    last = observation;
    return SampleVerdict::accepted;
  }
  void updateBelief() override { ++beliefs; }
  WheelCommand updateAction() override {
    ++actions;
    return wanted;
  }
  void hold(const WheelCommand& applied) override { held = applied; }
  void overrule(const WheelCommand& applied) override {
    overruled = applied;
    calls += "o";
  }
  void restart() override { calls += "r"; }
  void reset() override {
    set_point_ = {};
    calls += "!";
  }
  void resetMotion() override {
    last = {};
    calls += "f";
  }
  BodyVector believedVelocity() const override { return believed; }
  WheelCommand action() const override { return wanted; }
  double freeEnergy() const override { return 0.0; }
  double beliefStep() const override { return kTick; }
  int beliefStepsPerAction() const override { return 20; }

  bool called(char call) const { return calls.find(call) != std::string::npos; }

  WheelCommand wanted{4.0, 5.0};
  BodyVector believed = BodyVector::Zero();
  SetPoint set_point_;
  Observation last;
  WheelCommand held, overruled;
  std::string calls;  // o: overrule, r: restart, !: reset, f: resetMotion
  int beliefs = 0;
  int actions = 0;
};

class DriveLoopDuties : public testing::Test {
 protected:
  explicit DriveLoopDuties(const DriveParameters& parameters = {})
      : controller(new ScriptedController), loop(parameters, std::unique_ptr<VelocityController>(controller)) {
    loop.release();
    loop.setSetPoint(set_point, now);
  }

  /// Runs some ticks, with measurements every period and the set point every tenth of a second.
  void run(int ticks, bool measured = true) {
    for (int i = 0; i < ticks; ++i) {
      now += kTick;
      ++tick;
      if (tick % 20 == 7 && measured) measure();
      if (tick % 100 == 0) loop.setSetPoint(set_point, now);
      const auto due = loop.advance(now);
      if (!due) continue;
      ++commands;
      changes.push_back((due->vector() - command.vector()).cwiseAbs().maxCoeff());
      command = *due;
    }
  }

  void runToAction() {
    for (const int before = commands; commands == before;) run(1);
  }

  Observation observation(const ChannelValidity& valid = {}) const {
    return {now, yaw_rate, wheels.left, wheels.right, 0.0, 0.0, std::nullopt, valid};
  }
  bool measure() { return loop.observe(observation(), now); }

  SensorReading reading(const ChannelValidity& valid, double sample) const {
    return {observation(valid), InputSource::Sample::Constant(sample)};
  }
  void receiveWheels() { loop.receiveWheels(reading(kWheels, now), now); }
  void receiveImu() { loop.receiveImu(reading(kImu, now), now); }

  void report(bool RobotStatus::*set) {
    RobotStatus robot;
    robot.*set = true;
    loop.report(robot, now);
  }

  DriveStatus status() const { return loop.status().decision.status; }
  std::string why() const { return reason(loop.status()); }

  ScriptedController* const controller;
  double now = 10.0;
  long tick = 0;
  SetPoint set_point{0.4, 0.0, 0.1};
  DriveLoop loop;
  WheelCommand wheels{4.0, 5.0};
  double yaw_rate = 0.1;
  WheelCommand command;
  int commands = 0;
  std::vector<double> changes;  // of the command from one action to the next [rad/s]
};

TEST_F(DriveLoopDuties, BeliefStepOfAnInstantFollowsTheMessagesOfThatInstant) {
  loop.advance(now);
  const int before = controller->beliefs;
  loop.setSetPoint(set_point, now + 5 * kTick);
  EXPECT_EQ(controller->beliefs, before + 4);
  loop.updateBelief(now + 5 * kTick);
  EXPECT_EQ(controller->beliefs, before + 5);
}

TEST_F(DriveLoopDuties, BrakeOverrulesTheControllerAndKeepsItsBelief) {
  run(500);
  controller->calls.clear();
  report(&RobotStatus::emergency_stop);
  run(40);
  EXPECT_EQ(status(), DriveStatus::braking);
  EXPECT_EQ(controller->overruled, command);
  EXPECT_EQ(loop.action(), WheelCommand{});
  run(1000);
  EXPECT_EQ(command, WheelCommand{});
  EXPECT_FALSE(controller->called('!'));
}

TEST_F(DriveLoopDuties, DivergedBeliefIsResetUntilItIsPlausible) {
  run(500);
  controller->calls.clear();
  controller->believed(kForward) = 1e3;
  run(60);
  EXPECT_EQ(why(), "belief diverged");
  EXPECT_TRUE(controller->called('!'));
  EXPECT_EQ(controller->set_point_.forward, set_point.forward);
  controller->believed.setZero();
  run(40);
  controller->calls.clear();
  run(500);
  EXPECT_FALSE(controller->called('!')) << "it is over, though not acknowledged: " << why();
  EXPECT_NE(status(), DriveStatus::driving);
}

TEST_F(DriveLoopDuties, SourcesThatDoNotPairStop) {
  run(100);
  for (int i = 0; i < 400; ++i) {
    run(1, false);
    receiveWheels();
    receiveImu();
  }
  EXPECT_NE(status(), DriveStatus::driving);
  EXPECT_EQ(why(), "stamps of wheel speeds and IMU data do not pair");
}

TEST_F(DriveLoopDuties, RepeatedWheelSpeedsAreFrozenWhileAWheelTurns) {
  const std::tuple<WheelCommand, WheelCommand, bool, bool> rows[] = {
      {{0.0, 5.0}, {}, false, true}, {{5.0, 0.0}, {}, false, true},
      {{5.0, 0.0}, {}, true, false}, {{}, {0.0, 5.0}, false, true},    // the driver answers, the motor does not turn
      {{}, {}, false, false},        {{}, {0.7, 0.7}, false, false}};  // too little to move a wheel
  for (const auto& [measured, wanted, may_repeat, frozen] : rows) {
    SCOPED_TRACE(testing::Message() << measured.left << ", " << wanted.right);
    loop.start({}, now);
    loop.release();
    wheels = measured;
    controller->wanted = wanted;
    run(500);
    EXPECT_EQ(status(), DriveStatus::driving) << why();
    for (int i = 0; i < 600 && status() == DriveStatus::driving; ++i) {
      run(1);
      if (i % 20 != 5) continue;
      SensorReading repeated = reading(kWheels, 1.0);
      repeated.may_repeat = may_repeat;
      loop.receiveWheels(repeated, now);
    }
    EXPECT_EQ(why() == "wheel speeds frozen", frozen) << why();
  }
}

TEST_F(DriveLoopDuties, LateFeedbackStopsARobotThatHadFeedback) {
  run(500);
  EXPECT_EQ(why(), "") << "a robot without feedback";
  for (int i = 0; i < 300; ++i) {
    if (i % 20 == 0) loop.receiveFeedback(now, now);
    run(1);
  }
  EXPECT_EQ(why(), "");
  run(300);
  EXPECT_EQ(why(), "feedback of the motors too old");
}

TEST_F(DriveLoopDuties, MeasuredVelocityIsThatOfTheLastSamples) {
  EXPECT_TRUE(loop.measuredVelocity().array().isNaN().all());
  receiveWheels();
  EXPECT_NEAR(loop.measuredVelocity()(kForward), 0.098 * 4.5, 1e-9);
  EXPECT_TRUE(std::isnan(loop.measuredVelocity()(kYaw)));
  receiveImu();
  EXPECT_EQ(loop.measuredVelocity()(kYaw), yaw_rate);
  loop.start({}, now);
  EXPECT_TRUE(loop.measuredVelocity().array().isNaN().all());
}

TEST_F(DriveLoopDuties, PeriodsDueShortlyAfterALateActionAreOneAction) {
  run(60);
  runToAction();
  const int actions = controller->actions;
  loop.advance(now + 1.9 * kPeriod, now + kPeriod);
  EXPECT_EQ(controller->actions, actions + 1) << "late";
  loop.advance(now + 3.0 * kPeriod);
  EXPECT_EQ(controller->actions, actions + 2) << "two periods are due, and little more than one elapsed";
}

TEST_F(DriveLoopDuties, TimerAheadOrBehindTheClockIsNoStall) {
  loop.advance(1000.0, 10.0);  // a simulated clock that begins later than its timer
  EXPECT_EQ(loop.status().dropped_periods, 0u);
  EXPECT_LE(controller->actions, 1);
  now = 1000.0;
  run(59);
  const int actions = controller->actions;
  loop.advance(now, now + 0.5);
  EXPECT_LE(controller->actions, actions + 1);
  EXPECT_EQ(loop.status().dropped_periods, 0u);
}

TEST_F(DriveLoopDuties, BeliefRestartsWithTheCommandInForceAfterAStall) {
  controller->wanted = {4.0, 4.0};
  run(500);
  ASSERT_EQ(command.left, 4.0);
  now += 0.5;
  loop.setSetPoint(set_point, now);
  command = loop.advance(now).value();
  EXPECT_GT(loop.status().dropped_periods, 10u);
  controller->calls.clear();
  now += kTick;
  EXPECT_TRUE(measure());
  EXPECT_EQ(controller->calls, "ro");
  EXPECT_EQ(controller->overruled, command);
  run(600);
  controller->calls.clear();
  run(200);
  EXPECT_FALSE(controller->called('r')) << "it has recovered";
}

TEST_F(DriveLoopDuties, ClockThatRunsBackForgetsTheMotionAndBrakes) {
  run(500);
  const double before = command.left;
  controller->calls.clear();
  now -= 5.0;
  run(21);
  EXPECT_EQ(loop.status().clock_resets, 1u);
  EXPECT_TRUE(controller->called('f'));
  EXPECT_EQ(status(), DriveStatus::braking);
  EXPECT_LT(command.left, before);
  EXPECT_EQ(why().substr(0, 17), "clock jumped back");
  EXPECT_EQ(loop.setPoint().forward, 0.0) << "it was of another time";
  run(2000);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
  EXPECT_EQ(loop.status().clock_resets, 1u);
}

TEST_F(DriveLoopDuties, StartGoesOnFromTheWheelsAlone) {
  run(500);
  report(&RobotStatus::driver_fault);
  run(500);
  ASSERT_EQ(status(), DriveStatus::faulted);
  now -= 5.0;
  run(1);
  controller->calls.clear();
  loop.start({3.0, 2.0}, now);
  EXPECT_EQ(controller->calls, "fo");
  EXPECT_EQ(controller->overruled, (WheelCommand{3.0, 2.0}));
  EXPECT_NEAR(loop.command().left, 3.0, 1e-9);
  EXPECT_NEAR(loop.command().right, 2.0, 1e-9);
  EXPECT_EQ(status(), DriveStatus::idle);
  EXPECT_EQ(why(), "");
  EXPECT_EQ(loop.action(), WheelCommand{});
  loop.report({}, now);
  now += 1.0;
  loop.advance(now);
  EXPECT_EQ(loop.status().dropped_periods, 0u);
  run(200, false);
  EXPECT_EQ(why(), "no wheel speeds received yet") << "none is late";
}

TEST(StopReason, OfASensorFaultIsTheFaultOrTheLoss) {
  DriveLoopStatus status;
  status.decision.status = DriveStatus::faulted;
  status.decision.cause = StopCause::sensor_fault;
  status.fault = Fault::left_wheels_blocked;
  EXPECT_EQ(reason(status), "left wheels do not follow their command");
  status.fault = Fault::none;
  status.loss = Loss::unclear;
  EXPECT_EQ(reason(status), "sensors or motors faulty; too few channels count");
  status.loss = Loss::none;
  EXPECT_EQ(reason(status), "sensors or motors faulty");
}

class SharedMotors : public DriveLoopDuties {
 protected:
  SharedMotors() : DriveLoopDuties(shared()) {}

  static DriveParameters shared() {
    DriveParameters parameters;
    parameters.motors_shared = true;
    return parameters;
  }

  /// The motors get the loop's commands for some ticks. @param theirs another's instead.
  void runWith(int ticks, const WheelCommand* theirs = nullptr) {
    for (int i = 0; i < ticks; ++i) {
      if (tick % 20 == 3) loop.applied(theirs ? *theirs : command, AppliedSource::drive, now);
      run(1);
    }
  }

  const WheelCommand theirs{-3.0, -2.0};
};

TEST_F(SharedMotors, AreHandedOverAndTakenBackWithoutAJump) {
  runWith(500);
  EXPECT_FALSE(loop.status().handed_over);
  EXPECT_EQ(command, controller->wanted);
  runWith(1000, &theirs);
  EXPECT_TRUE(loop.status().handed_over);
  EXPECT_EQ(why(), "another source has the motors");
  EXPECT_EQ(controller->overruled, theirs);
  EXPECT_LE((command.vector() - theirs.vector()).cwiseAbs().maxCoeff(), MotorShare::kOffer + 1e-9);
  const int actions = controller->actions;
  runWith(100, &theirs);
  EXPECT_EQ(controller->actions, actions) << "no action while another drives";
  EXPECT_GT((loop.action().vector() - theirs.vector()).norm(), 0.0) << "the offer goes towards the set point";
  changes.clear();
  runWith(500);
  EXPECT_FALSE(loop.status().handed_over);
  EXPECT_LE(*std::max_element(changes.begin(), changes.end()), kLargestChange + 1e-9);
  EXPECT_EQ(command, controller->wanted);
}

TEST_F(SharedMotors, AreNotHandedOverWithoutSubscribersInABrakeOrAfterAStart) {
  runWith(500);
  report(&RobotStatus::no_subscriber);
  runWith(500, &theirs);
  EXPECT_FALSE(loop.status().handed_over);
  EXPECT_EQ(controller->overruled, theirs) << "the belief follows the motors";
  loop.report({}, now);
  runWith(500, &theirs);
  ASSERT_TRUE(loop.status().handed_over);
  report(&RobotStatus::emergency_stop);
  runWith(40, &theirs);
  EXPECT_FALSE(loop.status().handed_over);
  EXPECT_EQ(controller->overruled, theirs) << "the belief follows the motors";
  loop.report({}, now);
  loop.start({}, now);
  loop.release();
  runWith(600, &theirs);
  ASSERT_TRUE(loop.status().handed_over);
  loop.start({}, now);
  run(200);
  EXPECT_FALSE(loop.status().handed_over);
}

TEST_F(SharedMotors, AreHandedOverWhenTheWheelsDoOtherThanCommanded) {
  wheels = {-6.0, -6.0};
  bool handed_over = false;
  for (int i = 0; i < 1000; ++i) {
    if (tick % 20 == 3) receiveWheels();
    run(1);
    handed_over = handed_over || loop.status().handed_over;
  }
  EXPECT_TRUE(handed_over);
}

}  // namespace
}  // namespace jackal_aic
