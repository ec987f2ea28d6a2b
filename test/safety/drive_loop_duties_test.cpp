// What a drive loop owes its controller and its caller: which calls the controller gets, and what is answered.

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "jackal_aic/safety/drive_loop.hpp"

namespace jackal_aic {
namespace {

constexpr double kTick = 0.001;                           // s
constexpr double kPeriod = 0.02;                          // s
constexpr double kLimit = 20.0;                           // m/s^2, of the command
constexpr double kRadius = 0.098;                         // m
constexpr double kFarWheel = kLimit * kPeriod / kRadius;  // rad/s, of a period

/// A controller that wants what it was told to want, and writes down what it is asked.
class ScriptedController : public VelocityController {
 public:
  bool setSetPoint(const SetPoint& set_point) override {
    set_point_ = set_point;
    return true;
  }
  SampleVerdict observe(const Observation& observation) override {
    if (observation.stamp <= last.stamp) return SampleVerdict::stale;
    last = observation;
    return verdict;
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
  void forgetMotion() override {
    last = {};
    calls += "f";
  }
  BodyVector believedVelocity() const override { return believed; }
  WheelCommand action() const override { return wanted; }
  double freeEnergy() const override { return 0.0; }
  double beliefStep() const override { return kTick; }
  int beliefStepsPerAction() const override { return 20; }

  WheelCommand wanted{4.0, 5.0};
  BodyVector believed = BodyVector::Zero();
  SampleVerdict verdict = SampleVerdict::accepted;
  SetPoint set_point_;
  Observation last;
  WheelCommand held, overruled;
  std::string calls;  // o: overrule, r: restart, !: reset, f: forgetMotion
  int beliefs = 0;
  int actions = 0;
};

class DriveLoopDuties : public testing::Test {
 protected:
  explicit DriveLoopDuties(const DriveParameters& parameters = {}) : loop(parameters, made(controller)) {
    loop.release();
    loop.setSetPoint({0.4, 0.0, 0.1}, now);
  }

  static std::unique_ptr<ScriptedController> made(ScriptedController*& controller) {
    auto owned = std::make_unique<ScriptedController>();
    controller = owned.get();
    return owned;
  }

  /// Goes on for some ticks, with measurements every period and the set point every tenth of a second.
  void run(int ticks, bool measured = true) {
    for (int i = 0; i < ticks; ++i) {
      now += kTick;
      ++tick;
      if (tick % 20 == 7 && measured) measure();
      if (tick % 100 == 0 && set_points) loop.setSetPoint(set_point, now);
      if (const auto due = loop.advance(now)) {
        ++commands;
        changes.push_back((due->vector() - command.vector()).cwiseAbs().maxCoeff());
        command = *due;
      }
    }
  }

  /// Goes on to the next action.
  void toAction() {
    for (const int before = commands; commands == before;) run(1);
  }

  bool measure() {
    Observation y;
    y.stamp = now;
    y.wheel_left = wheels.left;
    y.wheel_right = wheels.right;
    y.yaw_rate = yaw_rate;
    return loop.observe(y, now);
  }

  SensorReading reading(bool of_wheels) const {
    Observation y;
    y.stamp = now;
    y.wheel_left = wheels.left;
    y.wheel_right = wheels.right;
    (of_wheels ? y.valid.yaw_rate : y.valid.wheel_left) = false;
    (of_wheels ? y.valid.acceleration : y.valid.wheel_right) = false;
    return {y, FrozenSource::Sample::Constant(now)};
  }

  DriveStatus status() const { return loop.status().decision.status; }
  std::string why() const { return reason(loop.status()); }

  ScriptedController* controller = nullptr;
  DriveLoop loop;
  double now = 10.0;
  long tick = 0;
  SetPoint set_point{0.4, 0.0, 0.1};
  bool set_points = true;
  WheelCommand wheels{4.0, 5.0};
  double yaw_rate = 0.1;
  WheelCommand command;
  int commands = 0;
  std::vector<double> changes;  // of the command from one action to the next [rad/s]
};

TEST_F(DriveLoopDuties, BeliefStepsAndActionsAreThoseOfTheTimeThatWentBy) {
  run(1000);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
  EXPECT_NEAR(controller->beliefs, 1000, 20);
  EXPECT_NEAR(commands, 50, 1);
  const int beliefs = controller->beliefs, actions = controller->actions;
  run(200);
  EXPECT_EQ(controller->beliefs, beliefs + 200);
  EXPECT_EQ(controller->actions, actions + 10);
}

TEST_F(DriveLoopDuties, NoBeliefStepOfTheInstantOfAMessageIsRunBeforeIt) {
  loop.advance(now);
  const int before = controller->beliefs;
  loop.setSetPoint(set_point, now + 5 * kTick);
  EXPECT_EQ(controller->beliefs, before + 4) << "that of now comes after what is told now";
  loop.updateBelief(now + 5 * kTick);
  EXPECT_EQ(controller->beliefs, before + 5);
}

TEST_F(DriveLoopDuties, TheControllerHoldsWhatTheGateLetsThrough) {
  controller->wanted = {30.0, 30.0};
  run(40);
  ASSERT_EQ(status(), DriveStatus::driving) << why();
  EXPECT_EQ(controller->held, command);
  EXPECT_LT(command.left, 30.0);
  EXPECT_EQ(loop.action(), controller->wanted) << "the action is told as it was before the limits";
  EXPECT_EQ(loop.command(), command);
}

TEST_F(DriveLoopDuties, WhileItBrakesTheControllerIsToldWhatIsDriven) {
  run(500);
  RobotStatus stopped;
  stopped.emergency_stop = true;
  loop.report(stopped, now);
  run(40);
  EXPECT_EQ(status(), DriveStatus::braking);
  EXPECT_EQ(controller->overruled, command);
  EXPECT_EQ(loop.action(), WheelCommand{}) << "there is no action";
  run(1000);
  EXPECT_EQ(command, WheelCommand{});
  EXPECT_EQ(loop.status().brakes, 1u);
}

TEST_F(DriveLoopDuties, ABeliefThatDivergedBeginsAnewWithTheSetPoint) {
  run(500);
  controller->calls.clear();
  controller->believed(kForward) = 1e3;
  run(60);
  EXPECT_EQ(why(), "belief diverged");
  EXPECT_NE(controller->calls.find('!'), std::string::npos);
  EXPECT_EQ(controller->set_point_.forward, set_point.forward);
  controller->believed.setZero();
  run(40);
  controller->calls.clear();
  run(500);
  EXPECT_EQ(controller->calls.find('!'), std::string::npos) << "it is over, though not acknowledged: " << why();
  EXPECT_NE(status(), DriveStatus::driving);
}

TEST_F(DriveLoopDuties, WhoeverStopsItForAnotherReasonKeepsTheBelief) {
  run(500);
  controller->calls.clear();
  RobotStatus stopped;
  stopped.motors_off = true;
  loop.report(stopped, now);
  run(500);
  EXPECT_EQ(controller->calls.find('!'), std::string::npos);
}

TEST_F(DriveLoopDuties, EachStatusOfTheRobotStopsForItsReason) {
  const auto whyWith = [this](auto set) {
    RobotStatus robot;
    set(robot);
    loop.report(robot, now);
    run(40);
    EXPECT_NE(status(), DriveStatus::driving);
    const std::string why = this->why();
    loop.start({}, now);
    loop.report({}, now);
    run(200);
    loop.setSetPoint({}, now);
    run(2000);
    EXPECT_EQ(status(), DriveStatus::driving) << why << ", then " << this->why();
    return why;
  };
  EXPECT_EQ(whyWith([](RobotStatus& r) { r.motors_off = true; }), "motors do not take velocity commands");
  EXPECT_EQ(whyWith([](RobotStatus& r) { r.robot_stopped = true; }), "robot reports that it is stopped");
  EXPECT_EQ(whyWith([](RobotStatus& r) { r.emergency_stop = true; }), "emergency stop");
  EXPECT_EQ(whyWith([](RobotStatus& r) { r.disabled = true; }), "disabled");
  EXPECT_EQ(whyWith([](RobotStatus& r) { r.ending = true; }), "controller is to end");
  EXPECT_EQ(whyWith([](RobotStatus& r) { r.driver_fault = true; }), "motor driver reports a fault");
  EXPECT_EQ(whyWith([](RobotStatus& r) { r.contended = true; }), "another node publishes commands");
  EXPECT_EQ(whyWith([](RobotStatus& r) { r.rivals = true; }), "more than one node publishes set points");
  EXPECT_EQ(whyWith([](RobotStatus& r) { r.graph_checked = false; }),
            "publishers of commands and emergency stop not checked yet");
}

TEST_F(DriveLoopDuties, ANameIsToldOfRivalsAlone) {
  run(100);
  EXPECT_EQ(reason(loop.status(), "/someone"), "");
  RobotStatus stopped;
  stopped.emergency_stop = true;
  loop.report(stopped, now);
  run(40);
  EXPECT_EQ(reason(loop.status(), "/someone"), "emergency stop");
  RobotStatus contended;
  contended.contended = true;
  loop.report(contended, now);
  run(40);
  EXPECT_EQ(reason(loop.status()), "another node publishes commands") << "nobody knows who";
}

// ---- measurements

TEST_F(DriveLoopDuties, SamplesThatAreTakenAreAnsweredWithTrue) {
  run(100);
  now += kTick;
  EXPECT_TRUE(measure());
  EXPECT_EQ(loop.status().rejected_measurements, 0u);
  EXPECT_FALSE(measure()) << "the same stamp";
  EXPECT_EQ(loop.status().rejected_measurements, 1u);
  now += kTick;
  controller->verdict = SampleVerdict::incomplete;
  EXPECT_FALSE(measure()) << "it came, and does not count";
  EXPECT_EQ(loop.status().rejected_measurements, 1u);
  controller->verdict = SampleVerdict::not_finite;
  now += kTick;
  EXPECT_FALSE(measure());
  EXPECT_EQ(loop.status().rejected_measurements, 2u);
}

TEST_F(DriveLoopDuties, SourcesThatDoNotPairAreNoMeasurement) {
  run(100);
  for (int i = 0; i < 400; ++i) {
    run(1, false);
    loop.receiveWheels(reading(true), now);
    loop.receiveImu(reading(false), now);
  }
  EXPECT_NE(status(), DriveStatus::driving);
  EXPECT_EQ(why(), "stamps of wheel speeds and IMU data do not pair");
}

TEST_F(DriveLoopDuties, ASourceIsObservedAloneOnlyWhileTheOtherIsSilent) {
  EXPECT_FALSE(loop.receiveWheels(reading(true), now)) << "nothing has come yet: the other may";
  run(100);
  EXPECT_FALSE(loop.receiveWheels(reading(true), now)) << "a pair will come";
  EXPECT_FALSE(loop.receiveImu(reading(false), now)) << "likewise";
  for (int i = 0; i < 400; ++i) {
    run(1, false);
    if (i % 20 == 0) loop.receiveWheels(reading(true), now);
  }
  now += kTick;
  EXPECT_TRUE(loop.receiveWheels(reading(true), now)) << "the IMU is silent";
  EXPECT_FALSE(controller->last.valid.yaw_rate);
  EXPECT_TRUE(controller->last.valid.wheel_left);
}

TEST_F(DriveLoopDuties, TheImuIsObservedAloneWhileTheWheelsAreSilent) {
  run(100);
  for (int i = 0; i < 400; ++i) {
    run(1, false);
    if (i % 20 == 0) loop.receiveImu(reading(false), now);
  }
  now += kTick;
  EXPECT_TRUE(loop.receiveImu(reading(false), now));
  EXPECT_TRUE(controller->last.valid.yaw_rate);
  EXPECT_FALSE(controller->last.valid.wheel_left);
}

TEST_F(DriveLoopDuties, AnImuThatRepeatsItselfIsFrozen) {
  run(500);
  const auto repeated = [this](bool repeats) {
    for (int i = 0; i < 600; ++i) {
      run(1);
      if (i % 20 != 5) continue;
      SensorReading imu = reading(false);
      if (repeats) imu.sample.setOnes();
      loop.receiveImu(imu, now);
    }
  };
  repeated(false);
  EXPECT_EQ(why(), "");
  repeated(true);
  EXPECT_NE(why().find("yaw rate"), std::string::npos) << why();
}

/// Wheel speeds that repeat for long under these speeds and this command.
class RepeatedWheels : public DriveLoopDuties {
 protected:
  bool stopped(const WheelCommand& measured, const WheelCommand& wanted) {
    wheels = measured;
    controller->wanted = wanted;
    run(500);
    EXPECT_EQ(status(), DriveStatus::driving) << why();
    for (int i = 0; i < 600 && status() == DriveStatus::driving; ++i) {
      run(1);
      if (i % 20 != 5) continue;
      SensorReading repeated = reading(true);
      repeated.sample.setOnes();
      loop.receiveWheels(repeated, now);
    }
    return why() == "wheel speeds frozen";
  }
};

TEST_F(RepeatedWheels, AreFrozenWhileAnyWheelTurnsOrIsToTurn) {
  EXPECT_TRUE(stopped({0.0, 5.0}, {}));
  loop.start({}, now);
  loop.release();
  run(100);
  EXPECT_TRUE(stopped({5.0, 0.0}, {}));
  loop.start({}, now);
  loop.release();
  run(100);
  EXPECT_TRUE(stopped({}, {0.0, 5.0})) << "the driver answers, the motors' controller is dead";
  loop.start({}, now);
  loop.release();
  run(100);
  EXPECT_FALSE(stopped({}, {})) << "encoders of wheels at rest";
  EXPECT_FALSE(stopped({}, {0.7, 0.7})) << "of wheels that a small command does not move";
}

TEST_F(DriveLoopDuties, WhatNoRobotReadsDoesNotCount) {
  run(100);
  yaw_rate = 15.0;  // below 5 times the limit of 4 rad/s
  run(40);
  EXPECT_TRUE(controller->last.valid.yaw_rate);
  yaw_rate = 25.0;
  run(40);
  EXPECT_FALSE(controller->last.valid.yaw_rate);
  EXPECT_TRUE(controller->last.valid.wheel_left);
  yaw_rate = 0.1;
  wheels.left = 120.0;  // below 5 times the limit of 25.5 rad/s
  run(40);
  EXPECT_TRUE(controller->last.valid.wheel_left);
  wheels.left = 140.0;
  run(40);
  EXPECT_FALSE(controller->last.valid.wheel_left);
}

TEST_F(DriveLoopDuties, FeedbackThatWasThereAndIsLateStops) {
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

TEST_F(DriveLoopDuties, AnOldStampOrALateArrivalIsLate) {
  run(500);
  for (int i = 0; i < 100; ++i) {
    run(1);
    SensorReading old = reading(true);
    old.observation.stamp = now - 0.5;
    loop.receiveWheels(old, now);
  }
  EXPECT_EQ(why().substr(0, 20), "wheel speeds too old") << why();
}

// ---- time

TEST_F(DriveLoopDuties, ALateTimerCatchesUpNoFasterThanTimeWentBy) {
  controller->wanted = {1.0, 1.0};
  run(60);
  ASSERT_EQ(status(), DriveStatus::driving) << why();
  toAction();
  controller->wanted = {100.0, 100.0};
  // Three periods late.
  const double before = command.left;
  const int actions = controller->actions;
  now += 3.0 * kPeriod;
  command = loop.advance(now).value();
  EXPECT_EQ(controller->actions, actions + 3);
  EXPECT_NEAR(command.left - before, 3.0 * kFarWheel, 1e-6);
}

TEST_F(DriveLoopDuties, PeriodsThatAreDueShortlyAfterALateActionAreOneAction) {
  run(60);
  toAction();
  const double boundary = now;
  const int actions = controller->actions;
  loop.advance(boundary + 1.9 * kPeriod, boundary + kPeriod);
  EXPECT_EQ(controller->actions, actions + 1) << "late";
  loop.advance(boundary + 3.0 * kPeriod);
  EXPECT_EQ(controller->actions, actions + 2) << "two periods are due, and little more than one went by";
}

TEST_F(DriveLoopDuties, ATimerSetForLaterBringsNoActionBeforeItsTime) {
  run(59);
  const int actions = controller->actions;
  loop.advance(now, now + 0.5);
  EXPECT_LE(controller->actions, actions + 1);
  EXPECT_EQ(loop.status().dropped_periods, 0u);
}

TEST_F(DriveLoopDuties, AClockThatBeginsLaterThanItsTimerIsNoStall) {
  loop.advance(1000.0, 10.0);
  EXPECT_EQ(loop.status().dropped_periods, 0u);
  EXPECT_LE(controller->actions, 1);
}

TEST_F(DriveLoopDuties, AfterAStallTheBeliefBeginsAnewWithTheCommandInForce) {
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
  EXPECT_EQ(controller->calls.find('r'), std::string::npos) << "it has recovered";
}

TEST_F(DriveLoopDuties, TimeThatRunsBackForgetsTheMotionAndBrakes) {
  run(500);
  controller->calls.clear();
  now -= 5.0;
  run(21);
  EXPECT_EQ(loop.status().clock_resets, 1u);
  EXPECT_NE(controller->calls.find('f'), std::string::npos);
  EXPECT_EQ(why().substr(0, 17), "clock jumped back");
  EXPECT_EQ(loop.setPoint().forward, 0.0) << "what was sent before is of another time";
  run(2000);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
  EXPECT_EQ(loop.status().clock_resets, 1u);
}

TEST_F(DriveLoopDuties, AStartForgetsTheAction) {
  run(500);
  ASSERT_EQ(loop.action(), controller->wanted);
  loop.start({}, now);
  EXPECT_EQ(loop.action(), WheelCommand{});
}

TEST_F(DriveLoopDuties, AStartForgetsAClockThatRanBack) {
  run(500);
  now -= 5.0;
  run(1);
  loop.start({}, now);
  run(40);
  EXPECT_EQ(why().find("clock"), std::string::npos) << why();
}

TEST_F(DriveLoopDuties, AStartGoesOnFromTheWheelsAndFromNothingElse) {
  run(500);
  RobotStatus robot;
  robot.driver_fault = true;
  loop.report(robot, now);
  run(500);
  ASSERT_EQ(status(), DriveStatus::faulted);
  controller->calls.clear();
  loop.start({3.0, 2.0}, now);
  EXPECT_EQ(controller->calls, "fo");
  EXPECT_EQ(controller->overruled, (WheelCommand{3.0, 2.0}));
  EXPECT_NEAR(loop.command().left, 3.0, 1e-9);
  EXPECT_NEAR(loop.command().right, 2.0, 1e-9);
  EXPECT_EQ(status(), DriveStatus::idle);
  EXPECT_EQ(why(), "");
  EXPECT_EQ(loop.action(), WheelCommand{});
  // What came before it tells nothing: a second later nothing is late, it has not come yet.
  loop.report({}, now);
  now += 1.0;
  loop.advance(now);
  EXPECT_EQ(loop.status().dropped_periods, 0u);
  loop.setSetPoint({0.1, 0.0, 0.0}, now);
  set_points = false;
  run(100, false);
  EXPECT_EQ(why(), "no wheel speeds received yet");
}

TEST_F(DriveLoopDuties, AFaultThatIsOverIsCountedAndForgotten) {
  run(500);
  RobotStatus robot;
  robot.contended = true;
  loop.report(robot, now);
  run(3000);
  EXPECT_EQ(status(), DriveStatus::faulted);
  EXPECT_EQ(loop.status().faults, 1u);
  EXPECT_LE(loop.status().brakes, 1u);
  loop.report({}, now);
  run(1500);
  set_point = {};
  run(500);
  set_point = {0.4, 0.0, 0.1};
  run(500);
  EXPECT_EQ(status(), DriveStatus::driving) << why();
  EXPECT_EQ(loop.status().faults, 1u);
}

// ---- shared motors

DriveParameters shared() {
  DriveParameters parameters;
  parameters.motors_shared = true;
  return parameters;
}

class SharedMotors : public DriveLoopDuties {
 protected:
  SharedMotors() : DriveLoopDuties(shared()) {}

  /// The motors have this command, and it is told, for some ticks.
  void runWith(const WheelCommand& applied, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      if (tick % 20 == 3) loop.applied(applied, AppliedSource::drive, now);
      run(1);
    }
  }

  /// The motors have what the loop sends.
  void runOwn(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      if (tick % 20 == 3) loop.applied(command, AppliedSource::drive, now);
      run(1);
    }
  }
};

TEST(StopReason, OfAFaultIsWhatWasFound) {
  DriveLoopStatus status;
  status.decision.status = DriveStatus::faulted;
  status.decision.cause = StopCause::sensor_fault;
  status.fault = Fault::left_wheels_blocked;
  EXPECT_EQ(reason(status), "left wheels do not follow their command") << "no sensor is faulty";
  status.fault = Fault::none;
  status.loss = Loss::unclear;
  EXPECT_EQ(reason(status), "sensors or motors faulty; too few channels count");
  status.loss = Loss::none;
  EXPECT_EQ(reason(status), "sensors or motors faulty") << "it is over, and was either";
}

TEST_F(SharedMotors, AreOursWhileTheyGetWhatWeSend) {
  runOwn(1000);
  EXPECT_FALSE(loop.status().handed_over);
  EXPECT_EQ(command, controller->wanted);
}

TEST_F(SharedMotors, OfAnotherAreFollowedAndTakenBackWithoutAJump) {
  runOwn(500);
  const WheelCommand theirs{-3.0, -2.0};
  runWith(theirs, 1000);
  EXPECT_TRUE(loop.status().handed_over);
  EXPECT_EQ(why(), "another source has the motors");
  EXPECT_EQ(controller->overruled, theirs);
  EXPECT_LE((command.vector() - theirs.vector()).cwiseAbs().maxCoeff(), MotorShare::kOffer + 1e-9);
  const int actions = controller->actions;
  runWith(theirs, 100);
  EXPECT_EQ(controller->actions, actions) << "no action while another drives";
  EXPECT_GT((loop.action().vector() - theirs.vector()).norm(), 0.0) << "what is offered goes towards the set point";
  changes.clear();
  runOwn(500);
  EXPECT_FALSE(loop.status().handed_over);
  EXPECT_LE(*std::max_element(changes.begin(), changes.end()), kFarWheel + 1e-9);
  EXPECT_EQ(command, controller->wanted);
}

TEST_F(SharedMotors, AreNobodysWhileItBrakes) {
  runOwn(500);
  const WheelCommand theirs{-3.0, -2.0};
  runWith(theirs, 500);
  ASSERT_TRUE(loop.status().handed_over);
  RobotStatus stopped;
  stopped.emergency_stop = true;
  loop.report(stopped, now);
  runWith(theirs, 40);
  EXPECT_FALSE(loop.status().handed_over);
  EXPECT_EQ(controller->overruled, theirs) << "the belief goes by what the motors have";
}

TEST_F(SharedMotors, AreForgottenByAStart) {
  runOwn(500);
  runWith({-3.0, -2.0}, 500);
  ASSERT_TRUE(loop.status().handed_over);
  loop.start({}, now);
  run(200);
  EXPECT_FALSE(loop.status().handed_over);
}

TEST_F(DriveLoopDuties, MotorsThatAreNotSharedAreOursWhateverIsTold) {
  for (int i = 0; i < 1000; ++i) {
    if (i % 20 == 3) loop.applied({-3.0, -2.0}, AppliedSource::drive, now);
    run(1);
  }
  EXPECT_FALSE(loop.status().handed_over);
  EXPECT_EQ(command, controller->wanted);
}

TEST_F(SharedMotors, AreAnothersWhereTheWheelsDoElseAndNobodyTells) {
  wheels = {-6.0, -6.0};
  bool handed_over = false;
  for (int i = 0; i < 1000; ++i) {
    if (tick % 20 == 3) loop.receiveWheels(reading(true), now);
    run(1);
    handed_over = handed_over || loop.status().handed_over;
  }
  EXPECT_TRUE(handed_over);
}

}  // namespace
}  // namespace jackal_aic
